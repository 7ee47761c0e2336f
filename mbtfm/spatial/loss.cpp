#include "mbtfm/spatial/loss.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <numeric>
#include <utility>

#include "mbtfm/spatial/observed.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::spatial {

Weighing weigh(BeadLoss loss, const Observed& observed, const VectorXd& residual, double degrees,
               const std::vector<double>& good) {
  const Index n = loss == BeadLoss::l1_by_component ? 1 : observed.n_components();
  const auto n_rows = static_cast<double>(residual.size());
  const double taken = std::sqrt(std::max(1 - degrees / n_rows, 0.1));  // followed noise leaves less
  const auto by_row = [n](const VectorXd& by_group) -> VectorXd {
    return by_group.transpose().replicate(n, 1).reshaped();
  };
  Weighing weighing;
  if (!weighs_by_residual(loss)) {
    weighing.by_row = good.empty() ? VectorXd::Ones(residual.size())
                                   : by_row(VectorXd::Map(good.data(), static_cast<Index>(good.size())));
    weighing.n_data = std::max(weighing.by_row.sum(), 1e-300);
    weighing.scale = weighing.by_row.cwiseSqrt().cwiseProduct(residual).norm() / std::sqrt(weighing.n_data) / taken;
    weighing.variance = weighing.scale * weighing.scale;
    return weighing;
  }
  const std::vector<double> lengths = inverse::residual_lengths(residual, n);
  weighing.scale = inverse::scale_of(lengths, n) / taken;
  const double scale = std::max(observed.states_errors ? 1.0 : 1e-300, weighing.scale);
  weighing.by_row = by_row(inverse::weights_of(shape_of(loss), residual, scale, n));
  const inverse::Estimator estimator = inverse::estimator_of(shape_of(loss), lengths, scale, n);
  weighing.variance = estimator.variance;
  weighing.n_data = n_rows * scale * scale * estimator.square / weighing.variance;
  return weighing;
}

namespace {

using Eigen::RowVectorXd;

constexpr int kNeighbours = 16;
constexpr int kLinear = 4;  ///< numbers of a linear field, for each component

struct Prediction {
  double distance = 0;  ///< of the bead from it, over the sigma of the beads
  double scatter = 0;   ///< of a component of the neighbours about it, likewise
  double leverage = 0;  ///< variance of the prediction over that of one bead
};

/// @param offsets  of the neighbours from the bead, neighbours × 3
/// @param over_sigma  displacements over their errors: neighbours × components, and of the bead
Prediction predicted(const MatrixXd& offsets, const MatrixXd& over_sigma, const RowVectorXd& own) {
  constexpr int kRounds = 8;
  const Index n = offsets.rows(), n_components = over_sigma.cols();
  MatrixXd linear(n, kLinear);
  linear << VectorXd::Ones(n), offsets / std::max(offsets.rowwise().norm().maxCoeff(), 1e-300);
  RowVectorXd middle(n_components);
  for (Index c = 0; c < n_components; ++c)
    middle[c] = numerics::median(std::vector<double>(over_sigma.col(c).begin(), over_sigma.col(c).end()));
  MatrixXd residuals = (over_sigma.rowwise() - middle).transpose();  // a column each
  const double left = std::sqrt(static_cast<double>(n) / static_cast<double>(n - kLinear));
  Prediction made;
  MatrixXd normal;
  for (int round = 0; round < kRounds; ++round) {
    made.scatter =
        left * inverse::scale_of(inverse::residual_lengths(residuals.reshaped(), n_components), n_components);
    const VectorXd weights =
        inverse::weights_of(inverse::Loss::tukey, residuals.reshaped(), std::max(made.scatter, 1e-300), n_components)
            .cwiseMax(1e-9);
    normal = linear.transpose() * weights.asDiagonal() * linear;
    normal.diagonal().array() += 1e-9 * normal(0, 0);  // beads in a plane show nothing across it
    const MatrixXd field = numerics::solve_symmetric(normal, linear.transpose() * weights.asDiagonal() * over_sigma);
    residuals = (over_sigma - linear * field).transpose();
    made.distance = (own - field.row(0)).norm();
  }
  made.leverage = numerics::inverse_symmetric(normal)(0, 0);
  return made;
}

/// All beads with those that are trusted.
AmongNeighbours compared_with(const Observed& observed, const std::vector<int>& trusted) {
  const auto& places = std::get<std::vector<Vec3>>(observed.at.points_um);
  const Index n = observed.n_components();
  std::vector<Vec3> theirs;
  for (const int b : trusted) theirs.push_back(places[b]);
  const numerics::Near near(theirs, observed.distance_um);
  const VectorXd u = observed.displacement_um.cwiseQuotient(observed.sigma_um);
  std::vector<Prediction> predictions;
  std::vector<double> scatters;
  for (int b = 0; b < observed.n_beads; ++b) {
    const Vec3 at = places[b];
    MatrixXd offsets(kNeighbours, 3), over_sigma(kNeighbours, n);
    Index k = 0;
    for (const int which : near.nearest(at, kNeighbours + 1)) {
      const int other = trusted[which];
      if (other == b || k == kNeighbours) continue;
      const Vec3 d = places[other] - at;
      offsets.row(k) << d.x, d.y, d.z;
      over_sigma.row(k++) = u.segment(n * other, n).transpose();
    }
    predictions.push_back(predicted(offsets, over_sigma, u.segment(n * b, n).transpose()));
    scatters.push_back(predictions.back().scatter);
  }
  const double least = observed.states_errors ? 1 : std::max(numerics::median(scatters), 1e-300);
  AmongNeighbours made;
  for (const Prediction& p : predictions) {
    made.error.push_back(std::max(p.scatter, least) * std::sqrt(1 + p.leverage));
    made.distance.push_back(p.distance / made.error.back());
  }
  return made;
}

/// Density of Student's distribution with so many degrees of freedom at vectors of n components and this length.
double student_density(double length, double n, double degrees) {
  const double size = std::exp(std::lgamma((degrees + n) / 2) - std::lgamma(degrees / 2));
  return size / std::pow(degrees * std::numbers::pi, n / 2) *
         std::pow(1 + length * length / degrees, -(degrees + n) / 2);
}

/// Of a bead that lies anywhere in the box of all displacements, each component over its sigma.
/// @param least  side of the box, of errors that no component is below
double density_in_box(const VectorXd& over_sigma, Index n, double least) {
  double density = 1;
  for (Index c = 0; c < n; ++c) {
    const auto component = over_sigma(Eigen::seq(c, Eigen::last, n));
    density /= std::max(component.maxCoeff() - component.minCoeff(), least);
  }
  return density;
}

struct Judged {
  std::vector<double> good;  ///< probabilities, by bead
  double log_likelihood = 0;
};

Judged judged(const AmongNeighbours& among, double n, double in_box, double degrees) {
  Judged found{std::vector<double>(among.distance.size(), 1), 0};
  constexpr int kMost = 200;
  constexpr double kSettled = 1e-6;
  double outlier_share = 0.1, before = 0;
  for (int step = 0; step < kMost && std::abs(outlier_share - before) > kSettled; ++step) {
    before = std::exchange(outlier_share, 0);
    found.log_likelihood = 0;
    for (std::size_t b = 0; b < found.good.size(); ++b) {
      const double as_good = (1 - before) * student_density(among.distance[b], n, degrees);
      const double as_astray = before * in_box * std::pow(among.error[b], n);
      const double both = std::max(as_good + as_astray, 1e-300);
      found.good[b] = as_good / both;
      found.log_likelihood += std::log(both);
      outlier_share += (1 - found.good[b]) / static_cast<double>(found.good.size());
    }
  }
  return found;
}

}  // namespace

AmongNeighbours among_neighbours(const Observed& observed) {
  constexpr int kRounds = 3;
  constexpr double kFar = 6;  // beyond the rejection point of biweight in three components
  std::vector<int> trusted(static_cast<std::size_t>(observed.n_beads));
  std::iota(trusted.begin(), trusted.end(), 0);
  AmongNeighbours made;
  for (int round = 0; round < kRounds && trusted.size() > kNeighbours; ++round) {
    made = compared_with(observed, trusted);
    trusted.clear();
    for (int b = 0; b < observed.n_beads; ++b) {
      if (made.distance[b] < kFar) trusted.push_back(b);
    }
  }
  return made;
}

std::vector<double> probabilities_of_good(BeadLoss loss, const Observed& observed) {
  if (loss != BeadLoss::mixture) return {};
  const AmongNeighbours among = among_neighbours(observed);
  if (among.error.empty()) return {};
  const Index n = observed.n_components();
  const double in_box = density_in_box(observed.displacement_um.cwiseQuotient(observed.sigma_um), n,
                                       *std::ranges::min_element(among.error));
  Judged best;
  for (const double degrees : {1.0, 2.0, 4.0}) {
    Judged next = judged(among, static_cast<double>(n), in_box, degrees);
    if (best.good.empty() || next.log_likelihood > best.log_likelihood) best = std::move(next);
  }
  for (double& p : best.good)
    p = p < 0.5 ? 0 : p;  // a hundredth of a bead that is forty errors off would count as many
  return best.good;
}

}  // namespace mbtfm::spatial
