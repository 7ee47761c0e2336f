/// The fit on a gel that is strained beyond linear elasticity, with forces free of any network.
#include "mbtfm/fit/strained_gel.h"
#include "mbtfm/fit/ready_cell.h"
#include "mbtfm/tensions/fit_results.h"
#include "substrate/choice/factory.h"
#include "substrate/choice/large_strain.h"
#include "substrate/loads.h"
#include "substrate/material.h"
#include "tests/support/test.h"

namespace mbtfm::fit {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// Two adhesions that pull at each other with 1.2 times the shear modulus, and beads all over.
struct Experiment {
  Parameters parameters;
  Cell cell;
  DisplacementField beads;
  VectorXd forces_nN;
};

Experiment two_adhesions() {
  Experiment e;
  e.parameters.gel = {.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = 40};
  constexpr double kRadius_um = 6, kMajor_um = 1.8, kMinor_um = 0.8;
  const double size_nN =
      1.2 * substrate::shear_modulus_kPa(e.parameters.gel) * std::numbers::pi / 4 * kMajor_um * kMinor_um;
  e.forces_nN.resize(4);
  for (int k = 0; k < 2; ++k) {
    const double angle = std::numbers::pi * k;
    const Vec2 out{std::cos(angle), std::sin(angle)};
    e.cell.adhesions.push_back({.adhesion_id = k + 1,
                                .position_um = kRadius_um * out,
                                .area_um2 = std::numbers::pi / 4 * kMajor_um * kMinor_um,
                                .major_axis_um = kMajor_um,
                                .minor_axis_um = kMinor_um,
                                .angle_rad = angle});
    e.forces_nN.segment<2>(2 * k) << -size_nN * out.x, -size_nN * out.y;
  }
  std::mt19937_64 random(3);
  const auto anywhere = [&] { return 10 * (2 * static_cast<double>(random() >> 11) * 0x1p-53 - 1); };
  for (int i = 0; i < 300; ++i) e.beads.push_back({{anywhere(), anywhere()}, {}, 0.01, {}});
  return e;
}

/// As a fit of a network would hold them.
tensions::EnsembleFit free_forces(tensions::LinearData data) {
  tensions::EnsembleFit fit;
  fit.forces.nN = tensions::free_forces_nN(data.reduced);
  fit.data = std::move(data);
  fit.meshes.resize(1);
  return fit;
}

/// Were the tangent taken for the secant, or the change forgotten, the answer would be off by what linear theory is.
TEST(StrainedGel, forces_that_made_a_displacement_on_it_are_found_again) {
  Experiment e = two_adhesions();
  const auto linear = choice::make_substrate(e.parameters.gel, e.parameters.substrate, 1);
  const GelUnderCell on{*linear, e.cell, e.parameters};
  const auto ellipses = substrate::ellipses_of(e.cell.adhesions);
  const auto points = points_of(e.beads);
  const VectorXd displacement =
      linear->response({ellipses}, {points})->displace(e.forces_nN) +
      choice::LargeStrain(e.parameters.gel, ellipses, points, e.forces_nN, 1).about(e.forces_nN).displacement_um;
  for (Index i = 0; i < std::ssize(e.beads); ++i)
    e.beads[i].displacement_um = {displacement[2 * i], displacement[2 * i + 1]};

  const auto error = [&](const tensions::EnsembleFit& fit) {
    return (fit.forces.nN - e.forces_nN).norm() / e.forces_nN.norm();
  };
  const tensions::EnsembleFit on_linear_gel = free_forces(data_of(on, e.beads));
  EXPECT_GT(error(on_linear_gel), 0.005);
  const tensions::EnsembleFit found = fit_on_strained_gel(
      {.on = on, .beads = e.beads}, on_linear_gel,
      [](tensions::LinearData data, const tensions::Trial&) { return free_forces(std::move(data)); }, 1);
  RecordProperty("errors", std::to_string(1e6 * error(on_linear_gel)) + " " + std::to_string(1e6 * error(found)));
  EXPECT_LT(error(found), 0.01 * error(on_linear_gel));
}

}  // namespace
}  // namespace mbtfm::fit
