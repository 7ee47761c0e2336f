#include "mbtfm/sheets/field_fit.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "mbtfm/sheets/profile.h"
#include "mbtfm/sheets/variation.h"
#include "mbtfm/tensions/intervals.h"
#include "mbtfm/tensions/robust.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::sheets {
namespace {

using tensions::LinearData;

constexpr int kStiffnesses = 80;                      // an eighth of an e-fold apart
constexpr int kSmoothings = 33;                       // four a decade
constexpr double kRoughest = 1e-4, kSmoothest = 1e4;  // of where data and prior weigh alike
constexpr double kTail = 0.025;

/// What a pair of stiffness and smoothing makes of the data.
struct Pair {
  std::size_t stiffness = 0, smoothing = 0;
  double log_evidence = 0, share = 0;  ///< the latter of the posterior
  double degrees = 0;
  VectorXd loads;
};

/// At one stiffness: the loads' normal equations.
struct Normal {
  double sheet_nN_per_um = 0;
  MatrixXd matrix;
  VectorXd right;
};

struct Posterior {
  std::vector<double> stiffnesses_nN_per_um, smoothings, by_stiffness, by_smoothing;
  VectorXd loads, loads_over_stiffness;  ///< means
  MatrixXd covariance, covariance_over_stiffness;
  double log_stiffness = 0, log_sigma = 0, log_smoothing = 0, degrees = 0;
};

std::vector<double> even_logarithms(double low, double high, int n) {
  std::vector<double> values;
  for (int k = 0; k < n; ++k) values.push_back(low * std::pow(high / low, static_cast<double>(k) / std::max(1, n - 1)));
  return values;
}

class FieldSearch {
 public:
  FieldSearch(const LinearData& data, const StiffnessTable& table, std::optional<double> known,
              const ContractionPrior& prior, double variance)
      : data_(data), table_(table), prior_(prior), variance_(variance) {
    const StiffnessRange range = table.sheet_nN_per_um();
    look_at(known ? std::vector{*known} : even_logarithms(range.low, range.high, kStiffnesses));
    const Index n = table.n_contractions();
    const MatrixXd& middle = normals_[normals_.size() / 2].matrix;
    const double alike = middle.topLeftCorner(n, n).trace() / variance_ / prior.trace();
    smoothings_ = even_logarithms(kRoughest * alike, kSmoothest * alike, kSmoothings);
    for (const double smoothing : smoothings_) precisions_.push_back(prior.precision(smoothing));
  }

  /// Over stiffnesses that are closer than the beads resolve.
  Posterior posterior() {
    constexpr double kFine = 1.0;  // steps that are a standard deviation at least
    constexpr double kReach = 6;   // standard deviations, or steps, to both sides
    constexpr int kMostRounds = 6;
    Posterior p = of_these();
    for (int round = 0; round < kMostRounds && normals_.size() > 1; ++round) {
      const std::vector<double>& M = p.stiffnesses_nN_per_um;
      const double step = std::log(M[1] / M[0]);
      if (p.log_sigma > kFine * step) break;
      const double reach = kReach * std::max(p.log_sigma, 0.5 * step);
      const StiffnessRange range = table_.sheet_nN_per_um();
      look_at(even_logarithms(std::max(range.low, std::exp(p.log_stiffness - reach)),
                              std::min(range.high, std::exp(p.log_stiffness + reach)), kStiffnesses));
      p = of_these();
    }
    return p;
  }

 private:
  void look_at(const std::vector<double>& stiffnesses_nN_per_um) {
    normals_.clear();
    for (const double M : stiffnesses_nN_per_um) {
      const MatrixXd columns =
          tensions::displace(data_.reduced, table_.shares({M, table_.known_adhesion_nN_per_um3()}));
      normals_.push_back({M, numerics::small_transposed_product(columns, columns),
                          numerics::transposed_matvec(columns, data_.reduced.target)});
    }
  }

  Posterior of_these() const {
    std::vector<Pair> pairs;
    for (std::size_t m = 0; m < normals_.size(); ++m)
      for (std::size_t l = 0; l < smoothings_.size(); ++l) pairs.push_back(pair(m, l));
    const double best = std::ranges::max_element(pairs, {}, &Pair::log_evidence)->log_evidence;
    double sum = 0;
    for (Pair& p : pairs) sum += p.share = std::exp(p.log_evidence - best);
    for (Pair& p : pairs) p.share /= sum;
    return mean_of(pairs);
  }

  numerics::SmallCholesky precision(const Normal& normal, std::size_t smoothing) const {
    const numerics::SmallCholesky factor(normal.matrix / variance_ + precisions_[smoothing]);
    MBTFM_ASSERT(factor.is_definite());
    return factor;
  }

  Pair pair(std::size_t m, std::size_t l) const {
    const Normal& normal = normals_[m];
    const numerics::SmallCholesky factor = precision(normal, l);
    Pair p{.stiffness = m, .smoothing = l, .loads = factor.solve(normal.right / variance_)};
    const Index n_bundles = std::ssize(table_.bundles());
    if (n_bundles > 0 && p.loads.tail(n_bundles).minCoeff() < 0)
      p.loads = best_loads(normal.matrix / variance_ + precisions_[l], normal.right / variance_, n_bundles);
    // Q/v but for |y|²/v, the same for all
    const double misfit = p.loads.dot(factor.multiply(p.loads)) - 2 * normal.right.dot(p.loads) / variance_;
    p.log_evidence = 0.5 * prior_.log_determinant(smoothings_[l]) - 0.5 * factor.log_determinant() - 0.5 * misfit;
    p.degrees = factor.solve_matrix(normal.matrix / variance_).trace();
    return p;
  }

  Posterior mean_of(const std::vector<Pair>& pairs) const {
    const Index n = table_.n_loads();
    Posterior all{.stiffnesses_nN_per_um = {},
                  .smoothings = smoothings_,
                  .by_stiffness = std::vector<double>(normals_.size(), 0),
                  .by_smoothing = std::vector<double>(smoothings_.size(), 0),
                  .loads = VectorXd::Zero(n),
                  .loads_over_stiffness = VectorXd::Zero(n),
                  .covariance = MatrixXd::Zero(n, n),
                  .covariance_over_stiffness = MatrixXd::Zero(n, n)};
    for (const Normal& normal : normals_) all.stiffnesses_nN_per_um.push_back(normal.sheet_nN_per_um);
    double squares = 0;
    for (const Pair& p : pairs) {
      const double M = normals_[p.stiffness].sheet_nN_per_um;
      all.by_stiffness[p.stiffness] += p.share;
      all.by_smoothing[p.smoothing] += p.share;
      all.log_stiffness += p.share * std::log(M);
      squares += p.share * std::log(M) * std::log(M);
      all.log_smoothing += p.share * std::log(smoothings_[p.smoothing]);
      all.degrees += p.share * p.degrees;
      all.loads += p.share * p.loads;
      all.loads_over_stiffness += p.share / M * p.loads;
      constexpr double kNone = 1e-9;
      if (p.share < kNone) continue;
      const MatrixXd second = precision(normals_[p.stiffness], p.smoothing).inverse() + p.loads * p.loads.transpose();
      all.covariance += p.share * second;
      all.covariance_over_stiffness += p.share / (M * M) * second;
    }
    all.log_sigma = std::sqrt(std::max(0.0, squares - all.log_stiffness * all.log_stiffness));
    all.covariance -= all.loads * all.loads.transpose();
    all.covariance_over_stiffness -= all.loads_over_stiffness * all.loads_over_stiffness.transpose();
    return all;
  }

  const LinearData& data_;
  const StiffnessTable& table_;
  const ContractionPrior& prior_;
  double variance_;
  std::vector<MatrixXd> precisions_;  ///< of the prior, by smoothing
  std::vector<Normal> normals_;
  std::vector<double> smoothings_;
};

Stiffnesses at_mean(const Posterior& posterior, const StiffnessTable& table) {
  return {std::exp(posterior.log_stiffness), table.known_adhesion_nN_per_um3()};
}

/// Whether the posterior ends where the table does, and not before.
struct Open {
  bool below = false, above = false;
};
Open open_ends(const Posterior& posterior) {
  if (posterior.by_stiffness.size() == 1) return {};
  return {posterior.by_stiffness.front() > kTail, posterior.by_stiffness.back() > kTail};
}

/// The stiffness below which this share of the posterior lies.
double quantile(const Posterior& posterior, double share) {
  const std::vector<double>& M = posterior.stiffnesses_nN_per_um;
  if (M.size() == 1) return M.front();
  const double half_step = 0.5 * std::log(M[1] / M[0]);
  double sum = 0;
  for (std::size_t k = 0; k < M.size(); ++k) {
    const double next = sum + posterior.by_stiffness[k];
    if (next >= share) return M[k] * std::exp(half_step * (2 * (share - sum) / posterior.by_stiffness[k] - 1));
    sum = next;
  }
  return M.back();
}

FittedEstimate estimate(Quantity quantity, const std::string& part, double value, double variance, Open open,
                        VectorXd by_unknown) {
  const double reach = tensions::kNormal95 * std::sqrt(std::max(0.0, variance));
  return fitted_estimate({.quantity = quantity,
                          .part = part,
                          .value = value,
                          .low = open.below ? std::nullopt : std::optional(value - reach),
                          .high = open.above ? std::nullopt : std::optional(value + reach)},
                         variance, std::move(by_unknown));
}

std::vector<FittedEstimate> estimates_of(const Posterior& p, const StiffnessTable& table, const VectorXd& mean) {
  const Index n = table.n_contractions(), at_M = table.n_loads();
  const Open open = open_ends(p);
  const double M = std::exp(p.log_stiffness);
  const double contraction = mean.dot(p.loads.head(n)), share = mean.dot(p.loads_over_stiffness.head(n));
  const auto variance = [&](const MatrixXd& covariance) { return mean.dot(covariance.topLeftCorner(n, n) * mean); };
  const auto by = [&](Index unknown, double factor) -> VectorXd { return factor * VectorXd::Unit(at_M + 2, unknown); };
  VectorXd by_mean = VectorXd::Zero(at_M + 2);
  by_mean.head(n) = mean;
  FittedEstimate stiffness = estimate(Quantity::stiffness, {}, M, std::pow(M * p.log_sigma, 2), open, by(at_M, M));
  if (stiffness.low) stiffness.low = quantile(p, kTail);
  if (stiffness.high) stiffness.high = quantile(p, 1 - kTail);
  // a stiff sheet pulls as its strain has it, a soft one as its contraction
  std::vector<FittedEstimate> estimates = {
      estimate(Quantity::contraction, kMeanPart, contraction, variance(p.covariance),
               {open.above && contraction < 0, open.above && contraction > 0}, by_mean),
      stiffness,
      estimate(Quantity::contraction_over_stiffness, kMeanPart, share, variance(p.covariance_over_stiffness),
               {open.below && share < 0, open.below && share > 0}, by_mean / M - by(at_M, share))};
  Index load = n;
  const auto tension = [&](Quantity quantity, const std::string& of) {
    estimates.push_back(estimate(quantity, of, p.loads(load), p.covariance(load, load), {}, by(load, 1)));
    ++load;
  };
  if (table.has_line()) tension(Quantity::line_tension, {});
  for (const sheet::Bundle& bundle : table.bundles()) {
    tension(Quantity::bundle_tension, "fibre " + std::to_string(bundle.fibre_id));
    estimates.back().low = std::max(0.0, *estimates.back().low);
  }
  return estimates;
}

}  // namespace

ContractionLattice::ContractionLattice(const sheet::Elements& elements, int n_points)
    : spacing_um_(std::sqrt(elements.area_um2() / n_points)) {
  low_um_ = extent_of(elements.triangles().nodes_um).low_um;
  std::map<std::array<int, 2>, int> point_at;
  std::set<std::array<int, 2>> touched;
  elements.for_each_point([&](int, int, const sheet::Shape& shape) {
    const Vec2 at = 1 / spacing_um_ * (shape.place_um - low_um_);
    touched.insert({static_cast<int>(std::floor(at.x)), static_cast<int>(std::floor(at.y))});
  });
  const auto point = [&](int column, int row) {
    const auto [found, is_new] = point_at.emplace(std::array{column, row}, static_cast<int>(points_.size()));
    if (is_new) points_.push_back({column, row});
    return found->second;
  };
  for (const auto& [column, row] : touched)
    squares_.push_back(
        {{point(column, row), point(column + 1, row), point(column + 1, row + 1), point(column, row + 1)}});
}

std::vector<Vec2> ContractionLattice::places_um() const {
  std::vector<Vec2> places;
  for (const auto& [column, row] : points_)
    places.push_back(low_um_ + spacing_um_ * Vec2{static_cast<double>(column), static_cast<double>(row)});
  return places;
}

double ContractionLattice::share(int point, Vec2 place_um) const {
  const Vec2 at = 1 / spacing_um_ * (place_um - low_um_);
  const auto [column, row] = points_[point];
  return std::max(0.0, 1 - std::abs(at.x - column)) * std::max(0.0, 1 - std::abs(at.y - row));
}

VectorXd ContractionLattice::shares_at(Vec2 place_um) const {
  VectorXd shares(n_points());
  for (int k = 0; k < n_points(); ++k) shares(k) = share(k, place_um);
  return shares;
}

std::vector<std::vector<double>> ContractionLattice::shares_on(const sheet::Elements& elements) const {
  std::vector<std::vector<double>> shares(points_.size());
  elements.for_each_point([&](int, int, const sheet::Shape& shape) {
    for (std::size_t k = 0; k < points_.size(); ++k) shares[k].push_back(share(static_cast<int>(k), shape.place_um));
  });
  return shares;
}

MatrixXd ContractionLattice::roughness() const {
  // of a square, by its corners around it, whatever its side
  constexpr double kSame = 2.0 / 3, kNext = -1.0 / 6, kAcross = -1.0 / 3;
  MatrixXd roughness = MatrixXd::Zero(n_points(), n_points());
  for (const Square& square : squares_)
    for (std::size_t i = 0; i < 4; ++i)
      for (std::size_t j = 0; j < 4; ++j)
        roughness(square.points[i], square.points[j]) += i == j ? kSame : (i + j) % 2 == 1 ? kNext : kAcross;
  return roughness;
}

VectorXd means_over(const sheet::Elements& elements, const ContractionLattice& lattice) {
  VectorXd mean = VectorXd::Zero(lattice.n_points());
  elements.for_each_point(
      [&](int, int, const sheet::Shape& shape) { mean += shape.weight_um2 * lattice.shares_at(shape.place_um); });
  return mean / elements.area_um2();
}

std::vector<ContractionAt> contractions_at(const sheet::Elements& elements, const ContractionLattice& lattice,
                                           const FieldFit& fit) {
  std::vector<ContractionAt> rows;
  for (const Vec2 p : elements.triangles().nodes_um) {
    const VectorXd shares = lattice.shares_at(p);
    const double s = shares.dot(fit.contractions);
    const double sigma = std::sqrt(std::max(0.0, numerics::quadratic_form(fit.covariance, shares)));
    rows.push_back({p, s, sigma, s - tensions::kNormal95 * sigma, s + tensions::kNormal95 * sigma});
  }
  return rows;
}

void add_error(FieldFit& fit, std::optional<double> SheetErrorParts::*part, const MatrixXd& changes_um) {
  const MatrixXd of_contractions =
      numerics::small_product(fit.sheet.answers.topRows(fit.contractions.size()), changes_um);
  fit.covariance += numerics::small_product(of_contractions, of_contractions.transpose());
  add_error(fit.sheet, part, changes_um);
}

FieldFit fit_field(LinearData data, const StiffnessTable& table, tensions::Loss loss, std::optional<double> known,
                   const ContractionLattice& lattice, const VectorXd& mean) {
  MBTFM_ASSERT(table.n_contractions() == lattice.n_points() && !table.adhesion_nN_per_um3());
  const double even_nN_per_um = Search(data, table, known, of_even_parts(table)).best().loads(0);
  const ContractionPrior prior(lattice.roughness(), even_nN_per_um * smooth_patterns(lattice.places_um(), mean),
                               table.n_loads());
  const auto amplitudes = [&](const Posterior& p) -> VectorXd {
    return numerics::matvec(table.shares(at_mean(p, table)), p.loads);
  };
  const auto found = [&](const LinearData& of, double variance) {
    return FieldSearch(of, table, known, prior, variance).posterior();
  };
  data = weighed(std::move(data), loss,
                 [&](const LinearData& of) { return amplitudes(found(of, tensions::noise_variance(of))); });
  // where the sheet does not explain the beads, what it leaves is noise to it, as in fit_sheet()
  double variance = tensions::noise_variance(data);
  Posterior p = found(data, variance);
  const auto n_unknowns = std::lround(p.degrees) + (known ? 0 : 1);
  const double of_misfit = tensions::misfit_variance(data, amplitudes(p), n_unknowns, loss);
  if (of_misfit > variance) p = found(data, variance = of_misfit);
  const Index n = table.n_contractions();
  FieldFit fit{.sheet = {},
               .contractions = p.loads.head(n),
               .covariance = p.covariance.topLeftCorner(n, n),
               .smoothing = std::exp(p.log_smoothing),
               .is_smoothing_at_end = p.by_smoothing.back() > kTail,
               .degrees = p.degrees - static_cast<double>(table.n_loads() - n)};
  SheetFit& s = fit.sheet;
  s.estimates = estimates_of(p, table, mean);
  s.stiffnesses = at_mean(p, table);
  s.loads = p.loads;
  s.variance = variance;
  const Directions directions = directions_about(table, s.stiffnesses, p.loads, known.has_value());
  const MatrixXd of_prior = variance * prior.precision(std::exp(p.log_smoothing));
  Linearised about = linearised(data, directions, variance, of_prior);
  s.residuals = residuals_of(data, amplitudes(p), directions, of_prior);
  split_by_noise(s.estimates, about, variance, data);
  s.answers = std::move(about.answers);
  const double n_numbers = p.degrees + (known ? 0 : 1);
  add_misfit(s, data, amplitudes(p), n_numbers);
  Models models(data, s.variance);
  const std::string name =
      std::string("sheet") + (table.has_line() ? "-with-line" : "") + (table.bundles().empty() ? "" : "-with-bundles");
  const Search even(data, table, known, of_even_parts(table));
  models.add(name, 1 + table.n_loads() - n + (known ? 0 : 1), even.amplitudes(even.best()));
  models.add(name + "-in-field", std::lround(n_numbers), s.node_amplitudes);
  s.models = models.all();
  s.own_model = s.models.size() - 1;
  s.report = {.converged = true, .iterations = kStiffnesses, .last_change = 0, .reason = "scanned over the stiffness"};
  return fit;
}

}  // namespace mbtfm::sheets
