#include <algorithm>
#include <map>
#include <string>

#include "pipeline/contract/files.h"
#include "pipeline/contract/stage.h"
#include "substrate/compliance.h"

namespace mbtfm {
namespace {

struct Parameters {
  Gel gel;
  substrate::SubstrateParameters substrate;
};

void declare(ParameterList& list, Parameters& p) {
  declare(list, p.gel);
  declare(list, p.substrate);
}

struct Load {
  std::vector<substrate::Ellipse> ellipses;
  std::vector<Vec2> forces_nN;
};

Load read_load(StageContext& context) {
  std::map<int, substrate::Ellipse> ellipse_of_id;
  for (const Adhesion& adhesion : read_adhesions(context.input("adhesions"))) {
    ellipse_of_id[adhesion.adhesion_id] = substrate::ellipse_of(adhesion);
  }
  const Path file = context.input("forces");
  Load load;
  for (const AdhesionForce& force : read_adhesion_forces(file)) {
    const auto found = ellipse_of_id.find(force.adhesion_id);
    if (found == ellipse_of_id.end()) {
      throw InputError(file.string(), "the adhesion_id of a row of " + context.input("adhesions").string(),
                       "'" + std::to_string(force.adhesion_id) + "'",
                       "both files must come from the same segmentation");
    }
    load.ellipses.push_back(found->second);
    load.forces_nN.push_back(force.force_nN);
  }
  return load;
}

StageReport run(const Parameters& parameters, StageContext& context) {
  const auto model = substrate::make_substrate(parameters.gel, parameters.substrate, context.threads);
  const Load load = read_load(context);
  const std::vector<Vec2> points = read_points(context.input("points"));
  context.progress(0.1, "solving for the substrate");
  const std::vector<Vec2> displacements = model->displacements_um(points, load.ellipses, load.forces_nN);
  DisplacementField field;
  double largest_um = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    field.push_back({.position_um = points[i], .displacement_um = displacements[i], .sigma_um = 0, .flag = {}});
    largest_um = std::max(largest_um, norm(displacements[i]));
  }
  write_displacement(context.output("out"), field);

  StageReport report;
  report.summary = std::to_string(points.size()) + " points, " + std::to_string(load.ellipses.size()) +
                   " loaded adhesions, model " + parameters.substrate.model;
  report.figures = {{"n_points", static_cast<std::int64_t>(points.size())},
                    {"n_adhesions", static_cast<std::int64_t>(load.ellipses.size())},
                    {"largest_displacement_um", largest_um}};
  for (const auto& figure : model->figures()) report.figures.push_back(figure);
  report.effects = model->effects();
  return report;
}

}  // namespace
}  // namespace mbtfm

int main(int argc, char** argv) {
  using namespace mbtfm;
  using Kind = FileArgument::Kind;
  return run_stage<Parameters>({.name = "substrate",
                                .purpose = "displace the surface of a gel by forces spread over adhesions",
                                .files = {{"adhesions", Kind::input, "adhesions.csv: the ellipses"},
                                          {"forces", Kind::input, "adhesion_forces.csv: adhesion_id, fx_nN, fy_nN"},
                                          {"points", Kind::input, "points of the surface: x_um, y_um"},
                                          {"out", Kind::output, "displacement.csv at the points"}}},
                               argc, argv, run);
}
