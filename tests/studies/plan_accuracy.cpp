/// plan_accuracy STUDY: how well plans hold. A table (CSV) on stdout.
///   errors [scene [same]]           standard errors predicted over the scatter of 100 drawn experiments, six scenes
///   (or
///                                   one of them, from 1), three noises
///   pairs [experiments [noise_um]]  least distance of two adhesions, predicted and drawn
///   pairs-in-space [experiments]    the same of two patches, by beads in a volume
///   scaling                         of the standard errors with noise, modulus and density
#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <boost/math/distributions/normal.hpp>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <map>
#include <numbers>
#include <optional>
#include <random>
#include <string>

#include "mbtfm/plan/grid.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/intervals.h"
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

/// The data of one experiment. @param seed  of the noise; none: exact beads, weighed as if they had it
tensions::ReducedData drawn_data(const tensions::LinearData& unit, double noise_um, std::optional<std::uint64_t> seed) {
  tensions::ReducedData drawn = unit.reduced;
  Eigen::VectorXd u_um = unit.displacement_um;
  if (seed) u_um += noise_um * noise_of(u_um.size(), *seed);
  drawn.target = reduced_target(unit, u_um) / noise_um;
  drawn.compliance = std::make_shared<const Eigen::MatrixXd>(*unit.reduced.compliance / noise_um);
  drawn.floor_squared = static_cast<double>(unit.n_used);
  return drawn;
}

/// The fit of one experiment, on a network that is not the cell's. @param near  a trial of that network
tensions::Trial fitted(const KnownCell& cell, const tensions::TensionProblem& problem, const tensions::Trial& near) {
  return tensions::fit_gauss_newton(problem, {}, problem.evaluate(cell.tensions_nN, &near)).trial;
}

Eigen::VectorXd fitted_tensions_nN(const KnownCell& cell, const tensions::LinearData& unit, double noise_um,
                                   std::optional<std::uint64_t> seed, const tensions::Trial& near) {
  const tensions::ReducedData data = drawn_data(unit, noise_um, seed);
  return fitted(cell, tensions::TensionProblem(cell.networks.front(), data, cell.adhesion_ids), near).tensions_nN;
}

/// About the fit of exact beads, which have this noise.
tensions::LocalMisfit about_exact(const KnownCell& cell, const tensions::LinearData& unit, double noise_um,
                                  const tensions::Trial& near) {
  const tensions::ReducedData data = drawn_data(unit, noise_um, {});
  const tensions::TensionProblem problem(cell.networks.front(), data, cell.adhesion_ids);
  const tensions::Trial exact = fitted(cell, problem, near);
  return tensions::local_misfit(exact, problem.jacobian(exact));
}

// --- standard errors

/// A standard error predicted over the scatter of drawn experiments.
struct Ratio {
  double value = 0;
  double chance = 0;  ///< standard deviation of its logarithm, as the scatter of so many experiments is not exact
  bool is_measurable = true;  ///< the bound is below the tension itself: what a plan calls possible
};
struct Ratios {
  std::vector<Ratio> all;
  int n_left_out = 0;  ///< tensions at their bound
};

/// @param kurtosis  of what is drawn
double chance_of(double kurtosis, double n) { return std::sqrt((kurtosis - 1) / (4 * n)); }

double scatter_of(const Eigen::VectorXd& found) {
  return std::sqrt((found.array() - found.mean()).square().sum() / static_cast<double>(found.size() - 1));
}

/// Of tensions away from their bound. @param found  a column an experiment
Ratios ratios_of(const Eigen::MatrixXd& found, const Eigen::VectorXd& predicted_nN) {
  constexpr double kOfNormal = 3;
  Ratios ratios;
  for (Eigen::Index i = 0; i < found.rows(); ++i) {
    const bool is_at_bound = found.row(i).mean() < 2 * predicted_nN[i];
    if (is_at_bound) ++ratios.n_left_out;
    if (!is_at_bound)
      ratios.all.push_back({predicted_nN[i] / scatter_of(found.row(i)), chance_of(kOfNormal, double(found.cols()))});
  }
  return ratios;
}

/// The same where the bounds t >= 0 are predicted with. Of tensions that are above zero in half of the experiments or
/// more by the prediction: others hang on few experiments.
/// @param foreseen  a column a draw of the prediction
/// @param bound_nN  standard errors without the bounds t >= 0
Ratios ratios_of_foreseen(const Eigen::MatrixXd& found, const Eigen::MatrixXd& foreseen,
                          const Eigen::VectorXd& bound_nN, const Eigen::VectorXd& tensions_nN) {
  Ratios ratios;
  for (Eigen::Index i = 0; i < found.rows(); ++i) {
    const Eigen::VectorXd of_one = foreseen.row(i);
    if (2 * (of_one.array() > 0).count() < of_one.size()) {
      ++ratios.n_left_out;
      continue;
    }
    const double predicted_nN = scatter_of(of_one),
                 kurtosis = ((of_one.array() - of_one.mean()) / predicted_nN).pow(4).mean();
    ratios.all.push_back({predicted_nN / scatter_of(found.row(i)), chance_of(kurtosis, double(found.cols())),
                          bound_nN[i] < tensions_nN[i]});
  }
  return ratios;
}

/// Root mean square of the ratios' logarithms about zero, less what chance makes of it.
double beyond_chance(const Ratios& ratios) {
  double squares = 0;
  for (const Ratio& r : ratios.all) squares += std::pow(std::log(r.value), 2) - std::pow(r.chance, 2);
  return std::sqrt(std::max(0.0, squares / static_cast<double>(ratios.all.size())));
}

double share_of(const Ratios& ratios, const auto& is_one) {
  return static_cast<double>(std::ranges::count_if(ratios.all, is_one)) / static_cast<double>(ratios.all.size());
}

/// Variance of the tensions that exact beads give, by the places of the beads: a fit's network is not the cell's, and
/// what that makes of the tensions hangs on where beads are. With the bound, which is the mean variance of given
/// places, it is the variance of experiments whose beads lie elsewhere (law of total variance).
Eigen::VectorXd variance_by_places(const std::vector<tensions::LocalMisfit>& of_places) {
  Eigen::MatrixXd found(of_places.front().tensions_nN.size(), std::ssize(of_places));
  for (std::size_t k = 0; k < of_places.size(); ++k) found.col(static_cast<Eigen::Index>(k)) = of_places[k].tensions_nN;
  const Eigen::VectorXd mean = found.rowwise().mean();
  return (found.colwise() - mean).rowwise().squaredNorm() / static_cast<double>(found.cols() - 1);
}

std::vector<tensions::LocalMisfit> with_noise(std::vector<tensions::LocalMisfit> of_places, double factor) {
  for (tensions::LocalMisfit& local : of_places) {
    local.H /= factor * factor;
    local.g /= factor * factor;
  }
  return of_places;
}

/// What noise makes of the fit, by its linear model with the bounds t >= 0, at each of these places of beads in turn.
Eigen::MatrixXd with_bounds_nN(const std::vector<tensions::LocalMisfit>& of_places) {
  constexpr Eigen::Index kForeseen = 2400;
  Eigen::MatrixXd foreseen(of_places.front().tensions_nN.size(), kForeseen);
  std::vector<Eigen::MatrixXd> root;
  for (const tensions::LocalMisfit& local : of_places) root.push_back(Eigen::LLT<Eigen::MatrixXd>(local.H).matrixL());
  numerics::parallel_for(static_cast<int>(kForeseen), kThreads, [&](int d) {
    const auto place = static_cast<std::size_t>(d) % of_places.size();
    const tensions::LocalMisfit& local = of_places[place];
    const Eigen::VectorXd of_noise = root[place] * noise_of(local.g.size(), 5000 + static_cast<std::uint64_t>(d));
    foreseen.col(d) =
        local.tensions_nN + tensions::bounded_quadratic_minimum(local.H, local.g + of_noise, -local.tensions_nN);
  });
  return foreseen;
}

struct Printed {
  const char* scenario;
  int seed = 0;
  double noise_percent = 0, noise_um = 0;
};

void print(const char* beads, const Printed& of, const Ratios& ratios) {
  std::vector<double> values, measurable;
  for (const Ratio& r : ratios.all) {
    values.push_back(r.value);
    if (r.is_measurable) measurable.push_back(r.value);
  }
  const auto [low, high] = std::ranges::minmax(values);
  const auto [low_of_them, high_of_them] = std::ranges::minmax(measurable);
  const double within = share_of(ratios, [](const Ratio&r) { return r.value >= 0.8 && r.value <= 1.25; }),
               by_chance =
                   share_of(ratios, [](const Ratio&r) { return std::abs(std::log(r.value)) < 1.96 * r.chance; });
  std::printf("%s,%s,%d,%g,%.4f,%zu,%d,%.3f,%.3f,%.3f,%.3f,%.3f,%.3f,%zu,%.3f,%.3f,%td\n", beads, of.scenario, of.seed,
              of.noise_percent, of.noise_um, values.size(), ratios.n_left_out, numerics::median(values), low, high,
              within, by_chance, beyond_chance(ratios), measurable.size(), low_of_them, high_of_them,
              std::ranges::count_if(measurable, [](double r) { return r < 0.8 || r > 1.25; }));
  std::fflush(stdout);
}

constexpr double kDensity = 1;
// draws of beads: far from those of a plan
constexpr std::uint64_t kFirstOfExperiments = 1000, kFirstOfPlaces = 2000;
constexpr std::array kShares = {0.02, 0.05, 0.1};  ///< noise over the largest displacement
using ByNoise = std::array<Eigen::MatrixXd, kShares.size()>;

/// A scene of the study: its cell, and beads at places that stay.
struct Studied {
  Scene scene;
  KnownCell cell;
  BeadsOnGel same;
  tensions::LinearData data_of_same;
  tensions::Trial near;
  std::array<double, kShares.size()> noise_um = {};
};
Studied studied(const char* scenario, int seed) {
  Parameters parameters;
  parameters.scenario = scenario;
  parameters.seed = static_cast<std::uint64_t>(seed);
  const Scene scene = simulated_scene(parameters);
  const KnownCell cell = known_cell(scene, kThreads);
  const BeadsOnGel same = beads_on_gel(scene, cell, kDensity, 10, kThreads);
  const tensions::LinearData data = unit_data(cell, same);
  Studied s{
      .scene = scene,
      .cell = cell,
      .same = same,
      .data_of_same = data,
      .near =
          tensions::TensionProblem(cell.networks.front(), data.reduced, cell.adhesion_ids).evaluate(cell.tensions_nN)};
  const Eigen::VectorXd u_um = s.same.response->displace(cell.forces_nN);
  double largest_um = 0;
  for (Eigen::Index row = 0; row < u_um.size(); row += 2)
    largest_um = std::max(largest_um, u_um.segment<2>(row).norm());
  for (std::size_t k = 0; k < kShares.size(); ++k) s.noise_um[k] = kShares[k] * largest_um;
  return s;
}

/// Which experiments are drawn.
enum class Beads {
  same,  ///< at the same places in all of them
  both   ///< and at others in each
};

/// Tensions of kDraws experiments, a column each.
struct Found {
  ByNoise same, others;
};
Found drawn(const Studied& s, Beads beads) {
  Found found;
  found.same.fill(Eigen::MatrixXd(s.cell.tensions_nN.size(), kDraws));
  found.others = found.same;
  numerics::parallel_for(kDraws, kThreads, [&](int d) {
    const auto draw = static_cast<std::uint64_t>(d) + 1;
    for (std::size_t k = 0; k < kShares.size(); ++k)
      found.same[k].col(d) = fitted_tensions_nN(s.cell, s.data_of_same, s.noise_um[k], draw, s.near);
    if (beads == Beads::same) return;
    const tensions::LinearData data_of_other =
        unit_data(s.cell, beads_on_gel(s.scene, s.cell, kDensity, kFirstOfExperiments + draw, 1));
    for (std::size_t k = 0; k < kShares.size(); ++k)
      found.others[k].col(d) = fitted_tensions_nN(s.cell, data_of_other, s.noise_um[k], draw, s.near);
  });
  return found;
}

/// The fits of exact beads at places that no experiment has.
std::vector<tensions::LocalMisfit> at_other_places(const Studied& s, double noise_um) {
  constexpr int kPlaces = 96;  // a standard deviation is then known to 7 %
  std::vector<tensions::LocalMisfit> of_places(kPlaces);
  numerics::parallel_for(kPlaces, kThreads, [&](int k) {
    const auto draw = kFirstOfPlaces + static_cast<std::uint64_t>(k);
    of_places[static_cast<std::size_t>(k)] =
        about_exact(s.cell, unit_data(s.cell, beads_on_gel(s.scene, s.cell, kDensity, draw, 1)), noise_um, s.near);
  });
  return of_places;
}

/// Beads at the same places in all experiments, and the bound of these beads; or at others in each, and the plan's.
/// @param only  a scene, from 1; 0: all
void study_errors(int only, Beads beads) {
  std::printf(
      "beads,scenario,seed,noise_percent,noise_um,n,left_out,median,lowest,highest,share_0.8_to_1.25,"
      "share_by_chance,beyond_chance,measurable,lowest_of_them,highest_of_them,beyond_0.8_to_1.25_of_them\n");
  const std::pair<const char*, int> scenes[] = {{"u2os", 1},  {"u2os", 2},    {"u2os", 3},
                                                {"dense", 1}, {"crowded", 1}, {"parallel-fibres", 1}};
  std::map<std::string, Ratios> all;
  const auto tell = [&](const std::string& name, const Printed& of, const Ratios& ratios) {
    print(name.c_str(), of, ratios);
    Ratios& whole = all[name];
    whole.all.insert(whole.all.end(), ratios.all.begin(), ratios.all.end());
    whole.n_left_out += ratios.n_left_out;
  };
  int number = 0;
  for (const auto& [name, seed] : scenes) {
    if (++number != only && only > 0) continue;
    const Studied s = studied(name, seed);
    const double own_kPa = s.scene.fit.gel.youngs_modulus_kPa;
    const Found found = drawn(s, beads);
    const Precision of_same = precision_of(s.scene, s.cell, s.same, kThreads);
    const auto at_same = about_exact(s.cell, s.data_of_same, s.noise_um.front(), s.near);
    const auto each_noise = [&](const auto& tell_of) {
      for (std::size_t k = 0; k < kShares.size(); ++k)
        tell_of(k, Printed{name, seed, 100 * kShares[k], s.noise_um[k]}, s.noise_um[k] * own_kPa);
    };
    each_noise([&](std::size_t k, const Printed& of, double scale) {
      tell("same", of, ratios_of(found.same[k], scale * of_same.tensions));
      tell("same with bounds", of,
           ratios_of_foreseen(found.same[k], with_bounds_nN(with_noise({at_same}, kShares[k] / kShares.front())),
                              scale * of_same.tensions, s.cell.tensions_nN));
    });
    if (beads == Beads::same) continue;
    const Precision plan = precision_at(s.scene, s.cell, {kDensity}, kThreads).precision.front();
    const auto at_others = at_other_places(s, s.noise_um.front());
    const Eigen::VectorXd of_places = variance_by_places(at_others);
    each_noise([&](std::size_t k, const Printed& of, double scale) {
      const Eigen::VectorXd by_beads = scale * plan.tensions;
      tell("others", of, ratios_of(found.others[k], by_beads));
      tell("others with places", of, ratios_of(found.others[k], (of_places + by_beads.cwiseAbs2()).cwiseSqrt()));
      tell("others with places and bounds", of,
           ratios_of_foreseen(found.others[k], with_bounds_nN(with_noise(at_others, kShares[k] / kShares.front())),
                              by_beads, s.cell.tensions_nN));
    });
  }
  for (const auto& [name, ratios] : all) print(name.c_str(), {"all"}, ratios);
}

// --- pairs

/// Where the chance to tell two adhesions apart is kChance, by experiments at five distances around an expected one: a
/// line of the chance's normal variable over the distance's logarithm, by weighted least squares.
struct DrawnDistance {
  double distance_um = 0, relative_error = 0;
};
/// Whether an experiment tells two at this distance apart.
using Tells = std::function<bool(double distance_um, int draw)>;
DrawnDistance drawn_distance(const Tells& tells, double expected_um, int n_experiments) {
  Eigen::Matrix2d normal = Eigen::Matrix2d::Zero();
  Eigen::Vector2d right = Eigen::Vector2d::Zero();
  const boost::math::normal standard;
  for (const double step : {-2, -1, 0, 1, 2}) {
    const double x = 0.2 * step, distance_um = expected_um * std::exp(x);
    std::vector<char> told(static_cast<std::size_t>(n_experiments));
    numerics::parallel_for(n_experiments, kThreads,
                           [&](int draw) { told[static_cast<std::size_t>(draw)] = tells(distance_um, draw); });
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

/// Drawn beside predicted, from a rough look first. @param n_experiments  a fifth at each distance
void print_pair(double density, double noise_um, double predicted_um, const Tells& tells, int n_experiments) {
  const double first_um = drawn_distance(tells, predicted_um, n_experiments / 20).distance_um;
  const DrawnDistance drawn =
      drawn_distance(tells, std::clamp(first_um, 0.5 * predicted_um, 2 * predicted_um), n_experiments / 5);
  std::printf("%g,%g,%.3f,%.3f,%.3f,%.3f\n", density, noise_um, predicted_um, drawn.distance_um, drawn.relative_error,
              predicted_um / drawn.distance_um);
  std::fflush(stdout);
}

constexpr double kBeadNoises_um[] = {0.005, 0.01, 0.015, 0.02, 0.03, 0.04, 0.06};

/// @param only_um  a noise; 0: all
void study_pairs(int n_experiments, double only_um) {
  const Gel gel{.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = 60};
  constexpr double kArea_um2 = 0.46;
  const double radius_um = std::sqrt(kArea_um2 / std::numbers::pi);
  const std::vector<double> densities = {0.25, 0.5, 1, 2};
  const PairResolution pairs(gel, kArea_um2, densities, kThreads);
  std::printf("beads_per_um2,noise_um,predicted_um,drawn_um,drawn_relative_error,ratio\n");
  for (std::size_t i = 0; i < densities.size(); ++i) {
    for (const double noise_um : kBeadNoises_um) {
      if (only_um > 0 && noise_um != only_um) continue;
      const auto predicted = pairs.least_distance_um(1, gel.youngs_modulus_kPa, i, noise_um);
      if (!predicted || *predicted > 8 || *predicted <= pairs.touching_um()) continue;
      const auto tells = [&](double distance_um, int draw) {
        return test::is_told({.gel = gel,
                              .radius_um = radius_um,
                              .distance_um = distance_um,
                              .beads_per_um2 = densities[i],
                              .noise_um = noise_um,
                              .half_field_um = 10 + 6 * distance_um},
                             draw);
      };
      print_pair(densities[i], noise_um, *predicted, tells, n_experiments);
    }
  }
}

/// Patches of 3 um that pull with 50 nN each on 15 kPa, as those of the scenes in space.
void study_pairs_in_space(int n_experiments) {
  const Gel gel{.youngs_modulus_kPa = 15, .poisson_ratio = 0.49, .thickness_um = 60};
  constexpr double kRadius_um = 3, kForce_nN = 50;
  const BeadVolume volume{.depth_um = 20, .axial_noise = 3};
  const std::vector<double> densities = {0.002, 0.008};
  const PairResolution pairs(gel, std::numbers::pi * kRadius_um * kRadius_um, densities, volume, {}, kThreads);
  std::printf("beads_per_um3,noise_um,predicted_um,drawn_um,drawn_relative_error,ratio\n");
  for (std::size_t i = 0; i < densities.size(); ++i) {
    for (const double noise_um : {0.01, 0.02, 0.05, 0.1, 0.2}) {
      const auto predicted = pairs.least_distance_um(kForce_nN, gel.youngs_modulus_kPa, i, noise_um);
      if (!predicted || *predicted <= pairs.touching_um()) continue;
      const auto tells = [&](double distance_um, int draw) {
        return test::is_told({.gel = gel,
                              .radius_um = kRadius_um,
                              .distance_um = distance_um,
                              .beads_per_um3 = densities[i],
                              .noise_um = noise_um / kForce_nN,  // of 1 nN
                              .volume = volume,
                              .half_field_um = 12 + 2.5 * distance_um},
                             draw);
      };
      print_pair(densities[i], noise_um, *predicted, tells, n_experiments);
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
  const Beads beads = argc > 3 && std::strcmp(argv[3], "same") == 0 ? Beads::same : Beads::both;
  if (asks("errors")) return study_errors(argc > 2 ? std::atoi(argv[2]) : 0, beads), 0;
  if (asks("pairs")) return study_pairs(argc > 2 ? std::atoi(argv[2]) : 1000, argc > 3 ? std::atof(argv[3]) : 0), 0;
  if (asks("pairs-in-space")) return study_pairs_in_space(argc > 2 ? std::atoi(argv[2]) : 1000), 0;
  if (asks("scaling")) return study_scaling(), 0;
  return std::fprintf(
             stderr,
             "plan_accuracy errors [scene [same]] | pairs [experiments [noise_um]] | pairs-in-space [experiments] | "
             "scaling\n"),
         2;
}
