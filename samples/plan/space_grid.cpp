#include "samples/plan/space_grid.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/report/texts.h"
#include "substrate/choice/large_strain.h"

namespace mbtfm::plan {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

constexpr int kDraws = 2;  // of beads: errors of a patch then differ by some per cent from one pool to another

Vector3d vector(const Vec3& v) { return {v.x, v.y, v.z}; }

VectorXd forces_of(const SpaceScene& scene) {
  VectorXd forces_nN(3 * std::ssize(scene.patches));
  for (std::size_t a = 0; a < scene.patches.size(); ++a)
    forces_nN.segment<3>(3 * static_cast<Index>(a)) = vector(scene.patches[a].force_nN);
  return forces_nN;
}

/// Where the scene has no field of its own, what forces spread evenly over the patches make.
void set_exact(const SpaceScene& scene, SpacePool& pool) {
  VectorXd& u_um = pool.problem.observed.displacement_um;
  const Index n = pool.problem.observed.n_components();
  if (!scene.exact_um) u_um = pool.problem.patch_response_um_per_nN * forces_of(scene);
  for (std::size_t b = 0; b < pool.beads.size(); ++b) {
    const Index row = n * static_cast<Index>(b);
    BeadInSpace& bead = pool.beads[b];
    if (scene.exact_um)
      bead.displacement_um = scene.exact_um(bead.position_um);
    else
      bead.displacement_um = {u_um[row], u_um[row + 1], n > 2 ? u_um[row + 2] : 0};
  }
  pool.problem.observed = spatial::observe(pool.beads, scene.gel, pool.problem.ground, scene.spatial);
}

SpacePool pool_of(const SpaceScene& scene, double beads_per_um3, const Work& work) {
  drawing::Random random(scene.seed, drawing::Stream::beads);
  std::vector<BeadInSpace> beads = beads_in(scene, kDraws * n_beads_of(scene, beads_per_um3), random);
  for (BeadInSpace& bead : beads) bead.sigma_um = 1, bead.sigma_z_um = scene.spatial.axial_sigma_ratio;
  // As the reconstruction's own: a lattice for twice to eight times the beads makes errors 10 to 24 % larger. Time
  // grows as the cube of the vertices, so that a plan allows for fewer of them than a reconstruction.
  constexpr double kMostVertices = 500;
  spatial::Meshing meshing{.spacing_um = scene.traction.spacing_um, .has_patches = true};
  if (!meshing.spacing_um) {
    const double area_um2 = (scene.high_um.x - scene.low_um.x) * (scene.high_um.y - scene.low_um.y);
    meshing.spacing_um =
        std::max(scene.spatial.spacing_beads / std::cbrt(beads_per_um3), std::sqrt(area_um2 / kMostVertices));
  }
  SpacePool pool{.beads = beads,
                 .problem = spatial::make_problem({beads, scene.gel, adhesions_of(scene), scene.outline_um},
                                                  scene.spatial, meshing, scene.substrate, work.threads)};
  if (pool.problem.map)
    throw UsageError("traction.spacing_um: a plan takes up to " + std::to_string(spatial::kMostVertices) +
                     " vertices of tractions, not " + std::to_string(pool.problem.mesh.n_vertices()));
  MBTFM_ASSERT(pool.problem.observed.n_beads == std::ssize(beads));
  set_exact(scene, pool);
  return pool;
}

/// Consecutive beads of the pool, which has them in random order.
std::vector<Index> run_of(std::size_t first, std::size_t n) {
  std::vector<Index> chosen(n);
  std::iota(chosen.begin(), chosen.end(), static_cast<Index>(first));
  return chosen;
}

/// sum += factor · f
void add(spatial::Foreseen& sum, const spatial::Foreseen& f, double factor) {
  if (sum.resolution_um.empty()) {  // the first: f + (factor − 1) f
    sum = f;
    factor -= 1;
  }
  sum.lambda += factor * f.lambda;
  sum.degrees += factor * f.degrees;
  sum.covariance_nN2 += factor * f.covariance_nN2;
  sum.by_noise_nN2 += factor * f.by_noise_nN2;
  sum.mean_nN += factor * f.mean_nN;
  sum.net_force_nN2 += factor * f.net_force_nN2;
  sum.net_by_noise_nN2 += factor * f.net_by_noise_nN2;
  for (std::size_t v = 0; v < sum.resolution_um.size(); ++v) sum.resolution_um[v] += factor * f.resolution_um[v];
}

std::size_t index_of(const std::vector<double>& list, double value) {
  return static_cast<std::size_t>(std::ranges::min_element(list, {}, [&](double v) { return std::abs(v - value); }) -
                                  list.begin());
}

/// Standard errors of one quantity, and their parts by the noise of the beads.
struct Errors {
  std::vector<double> all_nN, beads_nN;
  void add(double variance, double by_noise) {
    all_nN.push_back(std::sqrt(std::max(0.0, variance)));
    beads_nN.push_back(std::sqrt(std::max(0.0, by_noise)));
  }
};

Errors errors_of(const SpaceScene& scene, const spatial::Foreseen& f, SpaceQuantity quantity) {
  Errors errors;
  if (quantity == SpaceQuantity::net_force) {
    errors.add(f.net_force_nN2.trace(), f.net_by_noise_nN2.trace());
    return errors;
  }
  VectorXd along = VectorXd::Zero(3 * std::ssize(scene.patches));
  for (std::size_t a = 0; a < scene.patches.size(); ++a) {
    const auto at = 3 * static_cast<Index>(a);
    const Eigen::Matrix3d directions = patch_directions(scene, scene.patches[a]);
    along.segment<3>(at) = directions.col(0);
    if (quantity == SpaceQuantity::total_force) continue;
    const Vector3d e = directions.col(quantity == SpaceQuantity::force              ? 0
                                      : quantity == SpaceQuantity::tangential_force ? 1
                                                                                    : 2);
    errors.add(e.dot(f.covariance_nN2.block<3, 3>(at, at) * e), e.dot(f.by_noise_nN2.block<3, 3>(at, at) * e));
  }
  if (quantity == SpaceQuantity::total_force)
    errors.add(along.dot(f.covariance_nN2 * along), along.dot(f.by_noise_nN2 * along));
  return errors;
}

double total_of(const SpaceScene& scene) {
  double total_nN = 0;
  for (const SpacePatch& patch : scene.patches) total_nN += norm(patch.force_nN);
  return total_nN;
}

/// Of the vertex nearest to each patch, the middle one.
double resolution_at_patches(const SpaceScene& scene, const spatial::Problem& problem, const spatial::Foreseen& f) {
  std::vector<double> of_patches;
  for (const SpacePatch& patch : scene.patches) {
    const auto away = [&](Vec2 at) { return norm(at - patch.adhesion.position_um); };
    const auto nearest = std::ranges::min_element(problem.mesh.quads.points_um, {}, away);
    of_patches.push_back(f.resolution_um[nearest - problem.mesh.quads.points_um.begin()]);
  }
  return numerics::median_in(of_patches);
}

/// Of the gel that the pool was made with.
struct OnOwnGel {
  double largest_um = 0, traction_kPa = 0;
};
OnOwnGel on_own_gel(const SpaceScene& scene, const SpacePool& pool) {
  OnOwnGel own;
  for (const BeadInSpace& bead : pool.beads) own.largest_um = std::max(own.largest_um, norm(bead.displacement_um));
  double fourth = 0, square = 0;  // as spatial::mean_traction_kPa()
  for (const SpacePatch& patch : scene.patches) {
    const double area = patch.adhesion.area_um2, t2 = std::pow(norm(patch.force_nN) / area, 2);
    square += area * t2;
    fourth += area * t2 * t2;
  }
  own.traction_kPa = square > 0 ? std::sqrt(fourth / square) : 0;
  return own;
}

/// Density at which a patch's standard error is the target: on the line of logarithms between the densities, above
/// them as the noise of the beads has it, never below them. None beyond most_beads_per_um3().
std::optional<double> needed_beads(const std::vector<double>& densities, const std::vector<double>& errors_nN,
                                   double target_nN) {
  const auto first = std::ranges::find_if(errors_nN, [&](double e) { return e <= target_nN; });
  const auto by_law = [&](std::size_t k) { return densities[k] * std::pow(errors_nN[k] / target_nN, 2); };
  if (first == errors_nN.begin()) return densities.front();
  if (first == errors_nN.end()) {
    const double density = by_law(densities.size() - 1);
    return density <= most_beads_per_um3(densities) ? std::optional(density) : std::nullopt;
  }
  const auto k = static_cast<std::size_t>(first - errors_nN.begin());
  const double share = std::log(errors_nN[k - 1] / target_nN) / std::log(errors_nN[k - 1] / errors_nN[k]);
  return densities[k - 1] * std::pow(densities[k] / densities[k - 1], share);
}

Needed needed_of(const SpaceScene& scene, const Asked& asked, const SpaceForeseen& foreseen, double E,
                 double noise_um) {
  std::vector<std::vector<double>> by_patch(scene.patches.size());
  for (const double density : asked.densities) {
    const Errors errors = errors_of(scene, foreseen.of({E, density, noise_um}), SpaceQuantity::force);
    for (std::size_t a = 0; a < by_patch.size(); ++a) by_patch[a].push_back(errors.all_nN[a]);
  }
  std::vector<double> needed;
  for (const std::vector<double>& errors : by_patch)
    needed.push_back(
        needed_beads(asked.densities, errors, asked.target_nN).value_or(std::numeric_limits<double>::infinity()));
  return needed_by(E, noise_um, std::move(needed));
}

/// Gels on which the beads determine fewer numbers of the tractions than any map needs.
void add_few_numbers(const Asked& asked, SpaceGrid& grid) {
  constexpr double kFewNumbers = 24;  // as of the stage
  for (const double E : asked.youngs_modulus_kPa) {
    double most = 0;
    for (const double density : asked.densities)
      most = std::max(most, expected_of(grid, {E, density, asked.noise_um.front()}, SpaceQuantity::force).degrees);
    if (most < kFewNumbers) grid.warnings.push_back(report::sentence("plan.few-numbers", brief(E), brief(most)));
  }
}

}  // namespace

double most_beads_per_um3(const std::vector<double>& densities) { return 4 * densities.back(); }

std::size_t n_beads_of(const SpaceScene& scene, double beads_per_um3) {
  return static_cast<std::size_t>(std::lround(beads_per_um3 * scene.volume_um3()));
}

std::vector<SpacePool> pools_of(const SpaceScene& scene, const Asked& asked, const Work& work) {
  work.tell(0.02, "the gel's answer to tractions");
  const std::size_t n_densest = n_beads_of(scene, asked.densities.back());
  constexpr std::size_t kFewest = 20;
  if (n_beads_of(scene, asked.densities.front()) < kFewest)
    throw UsageError("beads_per_um3: " + brief(asked.densities.front()) + " are fewer than 20 beads in the " +
                     brief(scene.volume_um3()) + " um³ of the scene");
  constexpr std::size_t kMost = 20000;
  if (kDraws * n_densest > kMost)
    throw UsageError("beads_per_um3: " + brief(asked.densities.back()) + " are " + std::to_string(n_densest) +
                     " beads in the " + brief(scene.volume_um3()) + " um³ of the scene; a plan takes up to 10000");
  std::vector<SpacePool> pools;
  for (const double density : asked.densities) pools.push_back(pool_of(scene, density, work));
  return pools;
}

spatial::Problem part_of(const SpaceScene& scene, const SpacePool& pool, const std::vector<Index>& chosen, double noise,
                         drawing::Random* random) {
  std::vector<BeadInSpace> beads;
  for (const Index b : chosen) {
    BeadInSpace bead = pool.beads[b];
    bead.sigma_um *= noise;
    bead.sigma_z_um *= noise;
    if (random) {
      const double x = random->normal(), y = random->normal(), z = random->normal();
      bead.displacement_um += Vec3{bead.sigma_um * x, bead.sigma_um * y, bead.sigma_z_um * z};
    }
    beads.push_back(bead);
  }
  return pool.problem.with_beads(chosen, spatial::observe(beads, scene.gel, pool.problem.ground, scene.spatial));
}

std::size_t SpaceForeseen::index_of_density(double density) const { return index_of(beads_per_um3, density); }

const spatial::Foreseen& SpaceForeseen::of(const Point& p) const {
  return at[index_of_density(p.density)][index_of(noise_kPa_um, p.noise_um * p.youngs_modulus_kPa)];
}

SpaceForeseen foresee(const SpaceScene& scene, const Asked& asked, const std::vector<SpacePool>& pools,
                      const Work& work) {
  SpaceForeseen foreseen{.beads_per_um3 = asked.densities, .noise_kPa_um = {}, .at = {}};
  for (const double E : asked.youngs_modulus_kPa)
    for (const double noise_um : asked.noise_um) foreseen.noise_kPa_um.push_back(noise_um * E);
  const std::size_t n_densities = asked.densities.size();
  std::vector<std::vector<spatial::Foreseen>> by_job(kDraws * n_densities);
  numerics::parallel_for(static_cast<int>(by_job.size()), work.threads, [&](int j) {
    // the densest, which takes longest, first
    const auto job = static_cast<std::size_t>(j), k = n_densities - 1 - job / kDraws, draw = job % kDraws,
               n_beads = pools[k].beads.size() / kDraws;
    const spatial::Problem part = part_of(scene, pools[k], run_of(draw * n_beads, n_beads), 1, nullptr);
    const spatial::Foresight foresight(part, scene.traction, 1);
    for (const double noise : foreseen.noise_kPa_um)
      by_job[kDraws * k + draw].push_back(foresight.at(noise / scene.gel.youngs_modulus_kPa));
  });
  foreseen.at.resize(n_densities);
  for (std::size_t k = 0; k < n_densities; ++k) {
    for (std::size_t s = 0; s < foreseen.noise_kPa_um.size(); ++s) {
      spatial::Foreseen& mean = foreseen.at[k].emplace_back();
      for (std::size_t draw = 0; draw < kDraws; ++draw) add(mean, by_job[kDraws * k + draw][s], 1.0 / kDraws);
    }
  }
  return foreseen;
}

PairResolution pairs_of(const SpaceScene& scene, const Asked& asked, const PairDraws& draws, int threads) {
  return {scene.gel,       median_area_um2(adhesions_of(scene)),
          asked.densities, {.depth_um = scene.bead_depth_um, .axial_noise = scene.spatial.axial_sigma_ratio},
          draws,           threads};
}

SpaceGrid grid_of(const SpaceScene& scene, const Asked& asked, const std::vector<SpacePool>& pools,
                  const SpaceForeseen& foreseen, const PairResolution& pairs) {
  using enum SpaceQuantity;
  SpaceGrid grid;
  std::vector<OnOwnGel> own;
  for (const SpacePool& pool : pools) own.push_back(on_own_gel(scene, pool));
  const double total_nN = total_of(scene);
  for (const Point& point : points_of(asked)) {
    const auto& [E, density, noise_um] = point;
    const auto k = foreseen.index_of_density(density);
    const spatial::Foreseen& f = foreseen.of(point);
    for (const SpaceQuantity quantity : {force, tangential_force, normal_force, total_force, net_force}) {
      const Errors errors = errors_of(scene, f, quantity);
      const bool is_of_cell = quantity == total_force || quantity == net_force;
      const double target_nN = is_of_cell ? asked.within * total_nN : asked.target_nN;
      SpaceExpected& e =
          grid.expected.emplace_back(expected_by(point, quantity, errors.all_nN, errors.beads_nN, target_nN));
      e.from_background_nN = std::sqrt(std::max(0.0, std::pow(e.standard_error_nN, 2) - std::pow(e.from_beads_nN, 2)));
      if (quantity == force) {
        e.resolution_um = resolution_at_patches(scene, pools[k].problem, f);
        e.least_distance_um = pairs.least_distance_um(asked.tension_nN, E, k, noise_um);
      }
      e.degrees = f.degrees;
      e.largest_displacement_um = own[k].largest_um * scene.gel.youngs_modulus_kPa / E;
      e.left_out = choice::left_out_in_gel(with_modulus(scene.gel, E), own[k].traction_kPa);
    }
  }
  for (const double E : asked.youngs_modulus_kPa)
    for (const double noise_um : asked.noise_um) grid.needed.push_back(needed_of(scene, asked, foreseen, E, noise_um));
  grid.warnings = scene.warnings;
  for (std::string& warning : warnings_of(asked, grid, force)) grid.warnings.push_back(std::move(warning));
  add_few_numbers(asked, grid);
  return grid;
}

Eigen::Matrix3d patch_directions(const SpaceScene& scene, const SpacePatch& patch) {
  const spatial::Ground ground(scene.gel.surface.get());
  const Vector3d n = vector(ground.normal(patch.adhesion.position_um)), force = vector(patch.force_nN);
  const Vector3d along = force - force.dot(n) * n;
  Eigen::Matrix3d directions;
  directions.col(0) = force.norm() > 0 ? Vector3d(force.normalized()) : Vector3d::UnitX();
  directions.col(1) = along.norm() > 0 ? Vector3d(along.normalized()) : Vector3d(n.unitOrthogonal());
  directions.col(2) = n;
  return directions;
}

}  // namespace mbtfm::plan
