/// The displacement (um) beside an adhesion of area pi um² that pulls with 1 nN on a gel, and how many adhesions a file
/// holds.
#include <cstdio>

#include "pipeline/contract/version.h"
#include "pipeline/files/csv_files.h"
#include "substrate/choice/factory.h"

int main(int argc, char** argv) {
  mbtfm::Gel gel;
  gel.youngs_modulus_kPa = 8.4;
  mbtfm::substrate::SubstrateParameters parameters;
  parameters.model = mbtfm::substrate::ModelKind::layer;
  const auto model = mbtfm::choice::make_substrate(gel, parameters, 1);
  const mbtfm::substrate::Ellipse adhesion{.centre_um = {0, 0}, .semi_major_um = 1, .semi_minor_um = 1};
  const auto u_um = model->displacements_um({{5, 0}}, {adhesion}, {{1, 0}});
  const auto adhesions = argc > 1 ? mbtfm::files::read_adhesions(argv[1]).size() : 0;
  std::printf("mbtfm %s: %.5f um, %zu adhesions\n", mbtfm::kVersion, u_um[0].x, adhesions);
}
