/// Tractions that strain the gel beyond linear elasticity.
#include "mbtfm/spatial/repeated.h"
#include "pipeline/contract/numbers.h"
#include "substrate/choice/factory.h"
#include "substrate/material.h"
#include "tests/support/test.h"

namespace mbtfm::spatial {
namespace {

using Eigen::Index;
using Eigen::VectorXd;

const Gel kGel{.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.45, .thickness_um = 20};
constexpr double kRadius_um = 5, kHalf_um = 15;

/// Two patches that pull at each other, (1 - r²/a²)² of their peak.
struct Patch {
  Vec2 centre_um, pull;
};
constexpr Patch kPatches[] = {{{-7, 1}, {1, 0}}, {{7, -1}, {-1, 0}}};

Vec2 traction_kPa(Vec2 at, double peak_kPa) {
  Vec2 sum;
  for (const Patch& p : kPatches) {
    const double r = norm(at - p.centre_um) / kRadius_um;
    if (r < 1) sum += peak_kPa * std::pow(1 - r * r, 2) * p.pull;
  }
  return sum;
}

substrate::SubstrateParameters neo_hooke(Switch large_strain) {
  substrate::SubstrateParameters p;
  p.model = substrate::ModelKind::curved;
  p.material = MaterialLaw::neo_hooke;
  p.displacement_tolerance = 0.1;
  p.effects.large_strain = large_strain;
  return p;
}

std::vector<BeadInSpace> beads_at_rest(int n) {
  std::mt19937_64 random(7);
  const auto between = [&](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  std::vector<BeadInSpace> beads;
  for (int b = 0; b < n; ++b) {
    const double x = between(-kHalf_um, kHalf_um), y = between(-kHalf_um, kHalf_um), z = between(1, 8);
    beads.push_back({{x, y, z}, {}, 0.005, 0.015, {}});
  }
  return beads;
}

/// That pull towards the middle from both sides.
double force_nN(const Problem& problem, const VectorXd& t_kPa) {
  const std::vector<Vec3> vertices = problem.vertices_um();
  double sum = 0;
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const double x = vertices[v].x;
    if (std::abs(x) > 1e-9) sum -= std::copysign(problem.mesh.areas_um2[v], x) * t_kPa[3 * static_cast<Index>(v)];
  }
  return sum;
}

/// On the gel that moved the beads, so that nothing but its strains is left to be found: were the tangent taken for the
/// secant, or the change forgotten, the answer would be off by what linear theory is.
TEST(StrainedTractions, that_moved_beads_are_found_again) {
  const double peak_kPa = 0.8 * substrate::shear_modulus_kPa(kGel);
  std::vector<BeadInSpace> beads = beads_at_rest(200);
  Problem problem = make_problem({beads, kGel, {}, {}}, {}, {.spacing_um = 3.75}, neo_hooke(Switch::off), 2);
  VectorXd truth_kPa = VectorXd::Zero(problem.n_unknowns());
  const std::vector<Vec3> vertices = problem.vertices_um();
  for (std::size_t v = 0; v < vertices.size(); ++v) {
    const Vec2 pull = traction_kPa({vertices[v].x, vertices[v].y}, peak_kPa);
    truth_kPa.segment<2>(3 * static_cast<Index>(v)) << pull.x, pull.y;
  }
  const auto model = choice::make_substrate(kGel, neo_hooke(Switch::on), 2);
  const VectorXd u = response_of_vertices(*model, problem)->displace(truth_kPa);
  for (std::size_t b = 0; b < beads.size(); ++b) {
    const Index row = 3 * static_cast<Index>(b);
    beads[b].displacement_um = {u[row], u[row + 1], u[row + 2]};
  }
  problem.observed = observe(beads, kGel, problem.ground, {});

  tractions::TractionParameters parameters;
  parameters.lambda_um_per_kPa = 1e-3;  // exact data ask for next to none
  const auto find = [&](const Problem& of) { return reconstruct_tikhonov(of, parameters, {}, 2); };
  const SpatialReconstruction linear = find(problem);
  const Strained strained = on_strained_gel(problem, linear, neo_hooke(Switch::on), find, 2);
  const auto error = [&](const VectorXd& t_kPa) {
    return std::abs(force_nN(problem, t_kPa) / force_nN(problem, truth_kPa) - 1);
  };
  const auto map_error = [&](const VectorXd& t_kPa) { return (t_kPa - truth_kPa).norm() / truth_kPa.norm(); };
  const double of_linear = error(linear.traction_kPa), of_strained = error(strained.reconstruction.traction_kPa);
  RecordProperty("force", brief(of_linear) + " " + brief(of_strained));
  RecordProperty("map",
                 brief(map_error(linear.traction_kPa)) + " " + brief(map_error(strained.reconstruction.traction_kPa)));
  EXPECT_LE(strained.steps, 6);
  EXPECT_LE(of_strained, of_linear / 3);
  EXPECT_LE(map_error(strained.reconstruction.traction_kPa), map_error(linear.traction_kPa) / 3);
}

}  // namespace
}  // namespace mbtfm::spatial
