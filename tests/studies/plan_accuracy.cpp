/// plan_accuracy STUDY [scene]: how well plans hold. A table (CSV) on stdout.
///   errors    standard errors predicted over the scatter of 100 drawn experiments, six scenes (or one of them, from
///   1),
///             three noises
///   pairs     least distance of two adhesions, predicted and drawn, with [1000] experiments a point, at all noises or
///   [one] scaling   of the standard errors with noise, modulus and density
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <optional>
#include <random>

#include "mbtfm/plan/grid.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/tension_fit.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/numerics/parallel.h"
#include "tests/support/drawn_pair.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::plan;

constexpr int kThreads = 2, kDraws = 100;

/// u of the cell's own network with noise, reduced: C⁻ᵀ Gᵀ W² P u.
Eigen::VectorXd reduced_target(const tensions::LinearData& data, const Eigen::VectorXd& u_um) {
  Eigen::MatrixXd target = data.response->pull_back(tensions::squared_weights(data).asDiagonal() *
                                                    tensions::less_motion(data, Eigen::MatrixXd(u_um)));
  numerics::solve_upper_transposed(*data.reduced.compliance, target);
  return target;
}

Eigen::VectorXd noise_of(Eigen::Index n, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal(0, 1);
  Eigen::VectorXd noise(n);
  for (double& component : noise) component = normal(random);
  return noise;
}

/// Beads whose noise is 1 um.
tensions::LinearData unit_data(const KnownCell& cell, const BeadsOnGel& beads) {
  const DisplacementField exact = exact_beads(beads.places_um, *beads.response, cell.forces_nN, 1);
  return tensions::reduce(exact, beads.response, {}, 1, tensions::affine_motions(exact));
}

/// The fit of one experiment, on a network that is not the cell's. @param near  a trial of that network
/// @param seed  of the noise; none: exact beads, weighed as if they had it
Eigen::VectorXd fitted(const KnownCell& cell, const tensions::LinearData& unit, double noise_um,
                       std::optional<std::uint64_t> seed, const tensions::Trial& near) {
  tensions::ReducedData drawn = unit.reduced;
  Eigen::VectorXd u_um = unit.displacement_um;
  if (seed) u_um += noise_um * noise_of(u_um.size(), *seed);
  drawn.target = reduced_target(unit, u_um) / noise_um;
  drawn.compliance = std::make_shared<const Eigen::MatrixXd>(*unit.reduced.compliance / noise_um);
  drawn.floor_squared = static_cast<double>(unit.n_used);
  const tensions::TensionProblem problem(cell.networks.front(), drawn, cell.adhesion_ids);
  return tensions::fit_gauss_newton(problem, {}, problem.evaluate(cell.tensions_nN, &near)).trial.tensions_nN;
}

struct Scatters {
  std::vector<double> ratios;  ///< predicted over scatter, of tensions away from their bound
  int n_at_bound = 0;
};

/// Of the logarithm of a standard deviation that n experiments tell.
double chance_of(int n) { return 1 / std::sqrt(2.0 * (n - 1)); }

/// Root mean square of the ratios' logarithms about zero, less what chance makes of it.
double beyond_chance(const Scatters& s) {
  double squares = 0;
  for (const double r : s.ratios) squares += std::pow(std::log(r), 2) / static_cast<double>(s.ratios.size());
  return std::sqrt(std::max(0.0, squares - std::pow(chance_of(kDraws), 2)));
}

/// Ratios that are 1 but for chance, at 95 %.
double share_by_chance(const Scatters& s) {
  const auto n =
      std::ranges::count_if(s.ratios, [](double r) { return std::abs(std::log(r)) < 1.96 * chance_of(kDraws); });
  return double(n) / double(s.ratios.size());
}

/// Variance of the tensions that exact beads give, by the places of the beads: a fit's network is not the cell's, and
/// what that makes of the tensions hangs on where beads are. With the bound, which is the mean variance of given
/// places, it is the variance of experiments whose beads lie elsewhere (law of total variance).
Eigen::VectorXd variance_by_places(const KnownCell& cell, const BeadsOnGel& pool, double share, double noise_um,
                                   const tensions::Trial& near) {
  constexpr int kPlaces = 24;
  Eigen::MatrixXd found(cell.tensions_nN.size(), kPlaces);
  numerics::parallel_for(kPlaces, kThreads, [&](int k) {
    drawing::Random random(1000 + static_cast<std::uint64_t>(k), drawing::Stream::beads);
    found.col(k) = fitted(cell, unit_data(cell, some_of(pool, share, random)), noise_um, {}, near);
  });
  const Eigen::VectorXd mean = found.rowwise().mean();
  return (found.colwise() - mean).rowwise().squaredNorm() / (kPlaces - 1);
}

/// @param found  a column an experiment
Scatters scatters_of(const Eigen::MatrixXd& found, const Eigen::VectorXd& predicted_nN) {
  Scatters scatters;
  for (Eigen::Index i = 0; i < found.rows(); ++i) {
    const double mean = found.row(i).mean();
    const double sd = std::sqrt((found.row(i).array() - mean).square().sum() / static_cast<double>(found.cols() - 1));
    const bool is_at_bound = mean < 2 * predicted_nN[i];
    if (is_at_bound) ++scatters.n_at_bound;
    if (!is_at_bound) scatters.ratios.push_back(predicted_nN[i] / sd);
  }
  return scatters;
}

void print(const char* what, const char* name, int seed, double noise_percent, double noise_um, const Scatters& s) {
  const auto [low, high] = std::ranges::minmax(s.ratios);
  const auto n_within = std::ranges::count_if(s.ratios, [](double r) { return r >= 0.8 && r <= 1.25; });
  std::printf("%s,%s,%d,%g,%.4f,%zu,%d,%.3f,%.3f,%.3f,%.3f,%.3f,%.3f\n", what, name, seed, noise_percent, noise_um,
              s.ratios.size(), s.n_at_bound, numerics::median(s.ratios), low, high,
              double(n_within) / double(s.ratios.size()), share_by_chance(s), beyond_chance(s));
  std::fflush(stdout);
}

void add(Scatters& all, const Scatters& some) {
  all.ratios.insert(all.ratios.end(), some.ratios.begin(), some.ratios.end());
  all.n_at_bound += some.n_at_bound;
}

/// Beads at the same places in all experiments, and the bound of these beads; or at others in each, and the plan's.
/// @param only  a scene, from 1; 0: all
void study_errors(int only) {
  std::printf(
      "beads,scenario,seed,noise_percent,noise_um,n,at_bound,median,lowest,highest,share_0.8_to_1.25,"
      "share_by_chance,beyond_chance\n");
  const std::pair<const char*, int> scenes[] = {{"u2os", 1},  {"u2os", 2},    {"u2os", 3},
                                                {"dense", 1}, {"crowded", 1}, {"parallel-fibres", 1}};
  constexpr double kDensity = 1, kPool = 2.5;
  Scatters all_same, all_other, all_with_places;
  int number = 0;
  for (const auto& [name, seed] : scenes) {
    if (++number != only && only > 0) continue;
    Parameters parameters;
    parameters.scenario = name;
    parameters.seed = static_cast<std::uint64_t>(seed);
    const Scene scene = simulated_scene(parameters);
    const KnownCell cell = known_cell(scene, kThreads);
    const double own_kPa = scene.fit.gel.youngs_modulus_kPa;
    const Precision plan = precision_at(scene, cell, {kDensity}, kThreads).precision.front();
    const BeadsOnGel same = beads_on_gel(scene, cell, kDensity, 10, kThreads),
                     pool = beads_on_gel(scene, cell, kPool, 11, kThreads);
    const Precision of_same = precision_of(scene, cell, same, kThreads);
    const Eigen::VectorXd u_um = pool.response->displace(cell.forces_nN);
    double largest_um = 0;
    for (Eigen::Index row = 0; row < u_um.size(); row += 2)
      largest_um = std::max(largest_um, u_um.segment<2>(row).norm());
    const double shares[] = {0.02, 0.05, 0.1};
    std::vector<Eigen::MatrixXd> with_same(3, Eigen::MatrixXd(cell.tensions_nN.size(), kDraws)), with_other = with_same;
    const tensions::LinearData data_of_same = unit_data(cell, same);
    const tensions::Trial near =
        tensions::TensionProblem(cell.networks.front(), data_of_same.reduced, cell.adhesion_ids)
            .evaluate(cell.tensions_nN);
    numerics::parallel_for(kDraws, kThreads, [&](int d) {
      const auto draw = static_cast<std::uint64_t>(d) + 1;
      drawing::Random random(draw, drawing::Stream::beads);
      const tensions::LinearData data_of_other = unit_data(cell, some_of(pool, kDensity / kPool, random));
      for (std::size_t k = 0; k < 3; ++k) {
        with_same[k].col(d) = fitted(cell, data_of_same, shares[k] * largest_um, draw, near);
        with_other[k].col(d) = fitted(cell, data_of_other, shares[k] * largest_um, draw, near);
      }
    });
    const Eigen::VectorXd of_places = variance_by_places(cell, beads_on_gel(scene, cell, kPool, 12, kThreads),
                                                         kDensity / kPool, shares[0] * largest_um, near);
    for (std::size_t k = 0; k < 3; ++k) {
      const double noise_um = shares[k] * largest_um, scale = noise_um * own_kPa;
      const Scatters s = scatters_of(with_same[k], scale * of_same.tensions),
                     o = scatters_of(with_other[k], scale * plan.tensions),
                     p = scatters_of(with_other[k], (of_places + (scale * plan.tensions).cwiseAbs2()).cwiseSqrt());
      print("same", name, seed, 100 * shares[k], noise_um, s);
      print("others", name, seed, 100 * shares[k], noise_um, o);
      print("others, places counted", name, seed, 100 * shares[k], noise_um, p);
      add(all_same, s);
      add(all_other, o);
      add(all_with_places, p);
    }
  }
  print("same", "all", 0, 0, 0, all_same);
  print("others", "all", 0, 0, 0, all_other);
  print("others, places counted", "all", 0, 0, 0, all_with_places);
}

// --- pairs

/// Where the chance to tell two adhesions apart is kChance, by experiments at five distances around an expected one: a
/// line of the chance's normal variable over the distance's logarithm, by weighted least squares.
struct DrawnDistance {
  double distance_um = 0, relative_error = 0;
};
DrawnDistance drawn_distance(const Gel& gel, double radius_um, double density, double noise_um, double expected_um,
                             int n_experiments) {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  const boost::math::normal standard;
  for (const double step : {-2, -1, 0, 1, 2}) {
    const double x = 0.2 * step, distance_um = expected_um * std::exp(x);
    std::vector<char> told(static_cast<std::size_t>(n_experiments));
    numerics::parallel_for(n_experiments, kThreads, [&](int draw) {
      told[static_cast<std::size_t>(draw)] = test::is_told({.gel = gel,
                                                            .radius_um = radius_um,
                                                            .distance_um = distance_um,
                                                            .beads_per_um2 = density,
                                                            .noise_um = noise_um,
                                                            .half_field_um = 10 + 6 * distance_um},
                                                           draw);
    });
    const double n = n_experiments,
                 chance = (static_cast<double>(std::ranges::count(told, 1)) + 0.5) / (n + 1);  // neither 0 nor 1
    const double z = boost::math::quantile(standard, chance),
                 weight = n * std::pow(boost::math::pdf(standard, z), 2) / (chance * (1 - chance));
    const Eigen::Vector2d row(1, x);
    normal += weight * row * row.transpose();
    right += weight * z * row;
  }
  const Eigen::Matrix2d covariance = normal.inverse();
  const Eigen::Vector2d line = covariance * right;
  const double at = (boost::math::quantile(standard, kChance) - line[0]) / line[1];
  const Eigen::Vector2d row(1, at);
  return {expected_um * std::exp(at), std::sqrt(row.dot(covariance * row)) / line[1]};
}

/// @param n_experiments  of a point, a fifth at each distance
/// @param only_um  a noise; 0: all
void study_pairs(int n_experiments, double only_um) {
  const Gel gel{.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = 60};
  constexpr double kArea_um2 = 0.46;
  const double radius_um = std::sqrt(kArea_um2 / 3.141592653589793);
  const std::vector<double> densities = {0.25, 0.5, 1, 2};
  const PairResolution pairs(gel, kArea_um2, densities, kThreads);
  std::printf("beads_per_um2,noise_um,predicted_um,drawn_um,drawn_relative_error,ratio\n");
  for (std::size_t i = 0; i < densities.size(); ++i) {
    const double density = densities[i];
    for (const double noise_um : {0.005, 0.01, 0.015, 0.02, 0.03, 0.04, 0.06}) {
      if (only_um > 0 && noise_um != only_um) continue;
      const auto predicted = pairs.least_distance_um(1, gel.youngs_modulus_kPa, i, noise_um);
      if (!predicted || *predicted > 8 || *predicted <= pairs.touching_um()) continue;
      const double first_um =
          drawn_distance(gel, radius_um, density, noise_um, *predicted, n_experiments / 20).distance_um;
      const DrawnDistance drawn = drawn_distance(
          gel, radius_um, density, noise_um, std::clamp(first_um, 0.5 * *predicted, 2 * *predicted), n_experiments / 5);
      std::printf("%g,%g,%.3f,%.3f,%.3f,%.3f\n", density, noise_um, *predicted, drawn.distance_um, drawn.relative_error,
                  *predicted / drawn.distance_um);
      std::fflush(stdout);
    }
  }
}

// --- scaling

void study_scaling() {
  Parameters p;
  const Scene scene = simulated_scene(p);
  const KnownCell cell = known_cell(scene, kThreads);
  std::printf("beads_per_um2,draw,median_tension_error,total_force_error,median_force_error,median_free_error\n");
  for (const double density : {0.125, 0.25, 0.5, 1.0, 2.0}) {
    for (const std::uint64_t draw : {1, 2, 3}) {
      const Precision q = precision_of(scene, cell, beads_on_gel(scene, cell, density, draw, kThreads), kThreads);
      const double root = std::sqrt(density);
      const auto median = [&](const Eigen::VectorXd& v) {
        return root * numerics::median(std::vector<double>(v.begin(), v.end()));
      };
      std::printf("%g,%d,%.4f,%.4f,%.4f,%.4f\n", density, static_cast<int>(draw), median(q.tensions),
                  root * q.total_force, median(q.adhesion_forces), median(q.free_forces));
      std::fflush(stdout);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  const auto asks = [&](const char* study) { return argc >= 2 && std::strcmp(argv[1], study) == 0; };
  if (asks("errors")) return study_errors(argc > 2 ? std::atoi(argv[2]) : 0), 0;
  if (asks("pairs")) return study_pairs(argc > 2 ? std::atoi(argv[2]) : 1000, argc > 3 ? std::atof(argv[3]) : 0), 0;
  if (asks("scaling")) return study_scaling(), 0;
  return std::fprintf(stderr, "plan_accuracy errors [scene] | pairs [experiments [noise_um]] | scaling\n"), 2;
}
