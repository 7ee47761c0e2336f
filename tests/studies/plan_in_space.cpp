/// plan_in_space STUDY: how well plans of cells in space hold. A table (CSV) on stdout.
///   map [experiments]    how far apart two forces must be to be seen as two in the map: as the plan says, and drawn
///   lattice [scenario]   errors that a plan predicts, on lattices of tractions with more and fewer vertices
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <numbers>

#include "mbtfm/plan/space_grid.h"
#include "mbtfm/spatial/foresight.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/numerics/parallel.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::plan;
using Eigen::Index;

constexpr int kThreads = 2;

// --- map

constexpr double kField_um = 40, kDepth_um = 12, kRadius_um = 1, kForce_nN = 20;
constexpr Vec2 kMiddle_um{20.3, 19.6};  // of the pair: not on the lattice
const Gel kGel{.youngs_modulus_kPa = 10, .poisson_ratio = 0.45, .thickness_um = 40};
const std::vector<double> kDistances_um = {3, 4, 5, 6, 7, 8, 9.5, 11, 13, 15, 18, 21, 25};
const std::vector<Vec3> kDirections = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};

Vec2 place(double distance_um, int side) { return {kMiddle_um.x + 0.5 * side * distance_um, kMiddle_um.y}; }

/// Two discs at each distance.
std::vector<Adhesion> pairs() {
  std::vector<Adhesion> discs;
  for (const double distance_um : kDistances_um)
    for (const int side : {-1, 1})
      discs.push_back({.adhesion_id = static_cast<int>(discs.size()) + 1,
                       .position_um = place(distance_um, side),
                       .area_um2 = std::numbers::pi * kRadius_um * kRadius_um,
                       .major_axis_um = 2 * kRadius_um,
                       .minor_axis_um = 2 * kRadius_um});
  return discs;
}

/// Many beads, of which experiments have parts, and what tractions and all the discs do to them.
struct Pool {
  std::vector<BeadInSpace> beads;
  spatial::Problem problem;
};
Pool pool_of(double beads_per_um3, std::size_t n_beads) {
  drawing::Random random(1, drawing::Stream::beads);
  std::vector<BeadInSpace> beads(n_beads);
  for (BeadInSpace& bead : beads) {
    const double x = random.uniform(0, kField_um), y = random.uniform(0, kField_um);
    bead.position_um = {x, y, random.uniform(0, kDepth_um)};
    bead.displacement_um = {1, 0, 0};  // known later
    bead.sigma_um = 1, bead.sigma_z_um = 3;
  }
  const spatial::Meshing meshing{.spacing_um = spatial::SpatialParameters{}.spacing_beads / std::cbrt(beads_per_um3),
                                 .has_patches = true};
  return {beads, spatial::make_problem({beads, kGel, pairs(), {}}, {}, meshing, {}, kThreads)};
}

std::vector<Index> some_of(std::size_t n_all, std::size_t n, drawing::Random& random) {
  std::vector<Index> order(n_all);
  for (std::size_t i = 0; i < n_all; ++i) order[i] = static_cast<Index>(i);
  for (std::size_t i = 0; i < n; ++i)
    std::swap(order[i], order[i + static_cast<std::size_t>(random.below(static_cast<int>(n_all - i)))]);
  order.resize(n);
  return order;
}

/// The problem of these beads with this pair alone. @param noise  none: exact
spatial::Problem experiment(const Pool& pool, const std::vector<Index>& chosen, std::size_t pair, const Vec3& direction,
                            double noise_um, drawing::Random* noise) {
  const auto first = 6 * static_cast<Index>(pair);
  const Eigen::Vector3d e(direction.x, direction.y, direction.z);
  Eigen::VectorXd forces_nN(6);
  forces_nN << kForce_nN * e, kForce_nN * e;
  const Eigen::MatrixXd of_pair = pool.problem.patch_response_um_per_nN.middleCols(first, 6);
  const Eigen::VectorXd u_um = of_pair * forces_nN;
  std::vector<BeadInSpace> beads;
  for (const Index b : chosen) {
    BeadInSpace bead = pool.beads[static_cast<std::size_t>(b)];
    bead.displacement_um = {u_um[3 * b], u_um[3 * b + 1], u_um[3 * b + 2]};
    bead.sigma_um *= noise_um;
    bead.sigma_z_um *= noise_um;
    if (noise) {
      const double x = noise->normal(), y = noise->normal(), z = noise->normal();
      bead.displacement_um += Vec3{bead.sigma_um * x, bead.sigma_um * y, bead.sigma_z_um * z};
    }
    beads.push_back(bead);
  }
  spatial::Problem problem = pool.problem.with_beads(chosen, spatial::observe(beads, kGel, pool.problem.ground, {}));
  problem.patch_response_um_per_nN = Eigen::MatrixXd(problem.patch_response_um_per_nN.middleCols(first, 6));
  problem.adhesion_areas_um2 = Eigen::MatrixXd(problem.adhesion_areas_um2.middleRows(2 * static_cast<Index>(pair), 2));
  return problem;
}

/// The map along a direction at a place.
double at(const spatial::TractionMesh& mesh, const Eigen::VectorXd& traction_kPa, Vec2 place_um, const Vec3& e) {
  const std::vector<spatial::VertexShare> shares = shares_at(mesh, place_um);
  double along = shares.empty() ? std::nan("") : 0;
  for (const auto& [vertex, share] : shares) {
    const Eigen::Vector3d t = traction_kPa.segment<3>(3 * vertex);
    along += share * (t.x() * e.x + t.y() * e.y + t.z() * e.z);
  }
  return along;
}

/// The map midway over the map at the lower of the two places.
double dip(const spatial::TractionMesh& mesh, const Eigen::VectorXd& traction_kPa, double distance_um, const Vec3& e) {
  const double left = at(mesh, traction_kPa, place(distance_um, -1), e),
               right = at(mesh, traction_kPa, place(distance_um, 1), e), middle = at(mesh, traction_kPa, kMiddle_um, e);
  const double lower = std::min(left, right);
  return lower > 0 ? std::max(0.0, middle) / lower : 2;
}

/// What the plan says at the two places, mean over draws of beads.
double said_um(const Pool& pool, std::size_t n_beads, std::size_t pair, const Vec3& e, double noise_um) {
  constexpr int kDraws = 2;
  double sum = 0;
  for (int d = 0; d < kDraws; ++d) {
    drawing::Random random(2, drawing::Stream::beads, static_cast<std::uint64_t>(d));
    const spatial::Problem exact = experiment(pool, some_of(pool.beads.size(), n_beads, random), pair, e, 1, nullptr);
    const spatial::Foreseen f = spatial::Foresight(exact, {}, 1).at(noise_um);
    for (const int side : {-1, 1}) {
      const Vec2 there = place(kDistances_um[pair], side);
      const auto nearest =
          std::ranges::min_element(exact.mesh.quads.points_um, {}, [&](Vec2 v) { return norm(v - there); });
      sum += f.resolution_um[static_cast<std::size_t>(nearest - exact.mesh.quads.points_um.begin())] / (2 * kDraws);
    }
  }
  return sum;
}

void study_map(int n_experiments) {
  std::printf("beads_per_um3,noise_um,direction,distance_um,spacing_um,said_um,dip_median,share_dip,share_below_0.8\n");
  for (const double density : {0.004, 0.016}) {
    const auto n_beads = static_cast<std::size_t>(density * kField_um * kField_um * kDepth_um);
    const Pool pool = pool_of(density, 4 * n_beads);
    for (const double noise_um : {0.01, 0.04}) {
      for (std::size_t c = 0; c < kDirections.size(); ++c) {
        for (std::size_t pair = 0; pair < kDistances_um.size(); ++pair) {
          std::vector<double> dips(static_cast<std::size_t>(n_experiments));
          numerics::parallel_for(n_experiments, kThreads, [&](int k) {
            const auto stream = 10 + static_cast<std::uint64_t>(k);
            drawing::Random places(3, drawing::Stream::beads, stream), noise(3, drawing::Stream::noise, stream);
            const spatial::Problem drawn =
                experiment(pool, some_of(pool.beads.size(), n_beads, places), pair, kDirections[c], noise_um, &noise);
            dips[static_cast<std::size_t>(k)] =
                dip(drawn.mesh, spatial::reconstruct_tikhonov(drawn, {}, {}, 1).traction_kPa, kDistances_um[pair],
                    kDirections[c]);
          });
          const auto share_below = [&](double most) {
            return static_cast<double>(std::ranges::count_if(dips, [&](double d) { return d < most; })) / n_experiments;
          };
          std::printf("%g,%g,%c,%g,%.2f,%.2f,%.2f,%.2f,%.2f\n", density, noise_um, "xyz"[c], kDistances_um[pair],
                      pool.problem.mesh.spacing_um.x, said_um(pool, n_beads, pair, kDirections[c], noise_um),
                      numerics::median(dips), share_below(1), share_below(0.8));
          std::fflush(stdout);
        }
      }
    }
  }
}

// --- lattice

/// @param factors  of the scene's own density: from once on the beads' distance asks for more than 500 vertices
void study_lattice(const char* scenario, const std::vector<double>& factors) {
  Parameters parameters;
  parameters.scenario = scenario;
  parameters.noise_um = "0.05";
  SpaceScene scene = simulated_in_space(parameters, kThreads);
  const double area_um2 = (scene.high_um.x - scene.low_um.x) * (scene.high_um.y - scene.low_um.y);
  std::printf("beads_per_um3,most_vertices,vertices,spacing_um,patch_nN,total_nN,net_nN,resolution_um,numbers_told\n");
  for (const double factor : factors) {
    parameters.beads_per_um3 = std::to_string(factor * scene.own_beads_per_um3);
    for (const double most : {500.0, double(spatial::kMostVertices)}) {
      const double density = factor * scene.own_beads_per_um3;
      scene.traction.spacing_um =
          std::max(spatial::SpatialParameters{}.spacing_beads / std::cbrt(density), std::sqrt(area_um2 / most));
      const Asked asked = asked_in_space(parameters, scene);
      const std::vector<SpacePool> pools = pools_of(scene, asked, kThreads);
      const SpaceGrid grid = grid_of(scene, asked, pools, foresee(scene, asked, pools, kThreads),
                                     pairs_of(scene, asked, {2, 3}, kThreads));
      const auto of = [&](SpaceQuantity quantity) {
        return *std::ranges::find_if(grid.expected, [&](const SpaceExpected& e) {
          return e.quantity == quantity && e.point.youngs_modulus_kPa == scene.gel.youngs_modulus_kPa;
        });
      };
      const SpaceExpected patch = of(SpaceQuantity::force);
      std::printf("%.5g,%g,%d,%.2f,%.3f,%.3f,%.3f,%.3f,%.1f\n", density, most, pools.front().problem.mesh.n_vertices(),
                  *scene.traction.spacing_um, patch.standard_error_nN, of(SpaceQuantity::total_force).standard_error_nN,
                  of(SpaceQuantity::net_force).standard_error_nN, patch.resolution_um.value_or(0), patch.degrees);
      std::fflush(stdout);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const auto asks = [&](const char* study) { return argc >= 2 && std::strcmp(argv[1], study) == 0; };
  if (asks("map")) return study_map(argc > 2 ? std::atoi(argv[2]) : 40), 0;
  if (asks("lattice")) return study_lattice(argc > 2 ? argv[2] : "wave", {2}), 0;
  return std::fprintf(stderr, "plan_in_space map [experiments] | lattice [scenario]\n"), 2;
}
