#include "mbtfm/inverse/regularisation.h"

#include <algorithm>
#include <boost/math/interpolators/cardinal_cubic_b_spline.hpp>
#include <cmath>
#include <functional>

#include "mbtfm/inverse/loss.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/report.h"

namespace mbtfm::inverse {

namespace {

constexpr int kPointsPerDecade = 3;      // the criteria are smooth over a factor of two
constexpr double kLeastCurvature = 0.1;  // a radius of ten e-folds, four decades, is no corner to the eye
constexpr int kFine = 16;                // places between two points at which their spline is looked at

/// A spline through values at the points, as a function of the point's index.
auto spline_of(const std::vector<double>& values) {
  return boost::math::interpolators::cardinal_cubic_b_spline<double>(values.begin(), values.end(), 0.0, 1.0);
}

/// Where in the scan (as a point's index, fractions too) the function is smallest.
double smallest_at(std::size_t n_points, const std::function<double(double)>& f) {
  double best = 0, least = f(0);
  const int n_places = static_cast<int>(n_points - 1) * kFine;
  for (int i = 1; i <= n_places; ++i) {
    const double at = std::min<double>(static_cast<double>(i) / kFine, static_cast<double>(n_points) - 1);
    const double value = f(at);
    if (value < least) {
      least = value;
      best = at;
    }
  }
  return best;
}

double smallest_at(const std::vector<double>& values) {
  const auto spline = spline_of(values);
  return smallest_at(values.size(), [&](double at) { return spline(at); });
}

/// At an index of the points, fractions too.
double lambda_at(const std::vector<ScanPoint>& points, double at) {
  const double first = std::log(points.front().lambda), last = std::log(points.back().lambda);
  return std::exp(first + (last - first) * at / (static_cast<double>(points.size()) - 1));
}

/// By point, or by a value of each.
template <class From, class Function>
std::vector<double> each(const std::vector<From>& all, const Function& f) {
  std::vector<double> values;
  for (const From& one : all) values.push_back(f(one));
  return values;
}

// Logarithms of quantities that vanish only where the data do; rounding may leave less than nothing of a misfit.
double log_of(double value) { return std::log(std::max(value, 1e-300)); }

/// The lambda with this misfit, between the points; none where all fit worse. (Morozov, Sov. Math. Dokl. 7 (1966) 414)
std::optional<double> lambda_of_misfit(const std::vector<ScanPoint>& points, double misfit) {
  if (points.front().misfit <= misfit) return points.front().lambda;
  for (std::size_t i = 1; i < points.size(); ++i) {
    if (points[i].misfit > misfit) continue;
    const double above = log_of(points[i - 1].misfit), below = log_of(points[i].misfit);
    const double share = above > below ? (above - log_of(misfit)) / (above - below) : 0;
    return points[i - 1].lambda * std::pow(points[i].lambda / points[i - 1].lambda, share);
  }
  return std::nullopt;
}

}  // namespace

std::vector<double> lambdas_between(double largest, double smallest) {
  MBTFM_ASSERT(largest > smallest && smallest > 0);
  const int n = std::max(5, static_cast<int>(std::ceil(kPointsPerDecade * std::log10(largest / smallest))) + 1);
  std::vector<double> lambdas;
  for (int i = 0; i < n; ++i) lambdas.push_back(largest * std::pow(smallest / largest, i / (n - 1.0)));
  return lambdas;
}

double robust_variance(const VectorXd& residuals, double degrees, double degrees_of_square) {
  const double deviation = scale_of(residual_lengths(residuals, 1), 1);
  const auto n = static_cast<double>(residuals.size());
  return deviation * deviation * n / std::max(n - 2 * degrees + degrees_of_square, 1e-6 * n);
}

std::vector<double> log_determinants_of(const std::vector<ScanPoint>& points) {
  std::vector<double> values;
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (i > 0) sum += (points[i - 1].degrees + points[i].degrees) * std::log(points[i - 1].lambda / points[i].lambda);
    values.push_back(sum);
  }
  return values;
}

double unbiased_risk(const ScanPoint& point, double misfit, double n_data, double variance) {
  const double lambda2 = point.lambda * point.lambda;
  return -(2 * misfit + lambda2 * point.norm - 2 * variance * (n_data - point.degrees)) / lambda2;
}

Risks unbiased_risks(double n_data) {
  return [n_data](const std::vector<ScanPoint>& points, double variance) {
    return each(points, [&](const ScanPoint& p) { return unbiased_risk(p, p.misfit, n_data, variance); });
  };
}

LambdaScan judge(std::vector<ScanPoint> points, double n_data, std::optional<double> stated_variance,
                 const std::function<double(double lambda)>& variance_left_at, const Risks& risks) {
  MBTFM_ASSERT(points.size() >= 5);
  LambdaScan scan;
  scan.points = std::move(points);
  // (12) Golub, Heath & Wahba 1979
  scan.gcv = each(scan.points, [&](const ScanPoint& p) {
    return n_data * p.misfit / std::pow(std::max(n_data - p.degrees, 1e-6 * n_data), 2);
  });
  std::vector<double> log_gcv;
  for (const double g : scan.gcv) log_gcv.push_back(log_of(g));
  scan.by_gcv = lambda_at(scan.points, smallest_at(log_gcv));

  // (13) Hansen & O'Leary 1993. As lambda falls the L-curve runs left, then up: its corner turns clockwise.
  const auto x = spline_of(each(scan.points, [](const ScanPoint& p) { return log_of(p.misfit); }));
  const auto y = spline_of(each(scan.points, [](const ScanPoint& p) { return log_of(p.norm); }));
  const auto curvature_at = [&](double at) {
    const double dx = x.prime(at), dy = y.prime(at);
    const double turn = dy * x.double_prime(at) - dx * y.double_prime(at);
    return turn / std::pow(std::max(dx * dx + dy * dy, 1e-300), 1.5);
  };
  for (std::size_t i = 0; i < scan.points.size(); ++i) scan.curvature.push_back(curvature_at(static_cast<double>(i)));
  // At its ends a spline knows no curvature. Tractions that grow with the noise no faster than with the signal bend the
  // curve the other way all along: then it has no corner.
  const auto n_last = static_cast<double>(scan.points.size()) - 1;
  const double corner_at = std::clamp(
      smallest_at(scan.points.size(), [&](double at) { return -curvature_at(std::clamp(at, 2.0, n_last - 2)); }), 2.0,
      n_last - 2);
  if (curvature_at(corner_at) > kLeastCurvature) scan.by_l_curve = lambda_at(scan.points, corner_at);

  // (14)
  const std::vector<double> log_determinants = log_determinants_of(scan.points);
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const ScanPoint& p = scan.points[i];
    const double energy = p.misfit + p.lambda * p.lambda * p.norm;
    scan.evidence.push_back(-0.5 * n_data * log_of(energy) - 0.5 * log_determinants[i]);
  }
  const double highest = *std::max_element(scan.evidence.begin(), scan.evidence.end());
  for (double& e : scan.evidence) e -= highest;
  scan.by_evidence = lambda_at(scan.points, smallest_at(each(scan.evidence, [](double e) { return -e; })));

  // With the errors that the data state, or with the misfit's if it shows larger ones.
  const double left = variance_left_at(scan.by_gcv);
  scan.variance = std::max(left, stated_variance.value_or(0));
  scan.variance_source = scan.variance > left ? "the errors that the data state" : "the misfit";
  scan.risk = risks(scan.points, scan.variance);
  // (25b) Mallows 1973: what the tractions displace wants less smoothing than they do
  scan.by_prediction = lambda_at(scan.points, smallest_at(each(scan.points, [&](const ScanPoint& p) {
                                   return log_of(p.misfit + 2 * scan.variance * p.degrees);
                                 })));
  if (stated_variance) scan.by_discrepancy = lambda_of_misfit(scan.points, n_data * *stated_variance);
  const RiskScale scale(scan.risk);
  scan.by_risk = lambda_at(scan.points, smallest_at(each(scan.risk, [&](double r) { return scale.to(r); })));
  return scan;
}

Refinement::Refinement(const std::vector<ScanPoint>& points) {
  const std::size_t n_places = (points.size() - 1) * kFine;
  const double ratio = points.back().lambda / points.front().lambda;
  for (std::size_t i = 0; i <= n_places; ++i) {
    lambdas.push_back(points.front().lambda * std::pow(ratio, static_cast<double>(i) / static_cast<double>(n_places)));
  }
}

std::vector<double> Refinement::of(const std::vector<double>& values, const std::function<double(double)>& to,
                                   const std::function<double(double)>& from) const {
  std::vector<double> fine;
  const auto spline = spline_of(each(values, to));
  for (std::size_t i = 0; i < lambdas.size(); ++i) {
    fine.push_back(from(spline(std::min(static_cast<double>(i) / kFine, static_cast<double>(values.size()) - 1))));
  }
  return fine;
}

RiskScale::RiskScale(const std::vector<double>& risk)
    : least(*std::min_element(risk.begin(), risk.end())), depth(std::max(std::abs(least), 1e-300)) {}
double RiskScale::to(double risk) const { return std::asinh((risk - least) / depth); }
double RiskScale::from(double tamed) const { return least + depth * std::sinh(tamed); }

double chosen_lambda(const LambdaScan& scan, LambdaCriterion criterion) {
  switch (criterion) {
    case LambdaCriterion::risk:
      return scan.by_risk;
    case LambdaCriterion::gcv:
      return scan.by_gcv;
    case LambdaCriterion::evidence:
      return scan.by_evidence;
    case LambdaCriterion::discrepancy:
      if (scan.by_discrepancy) return *scan.by_discrepancy;
      throw NotSolved({.reason = "no lambda brings the misfit down to what the stated errors leave, or none are "
                                 "stated: set lambda_by = risk, which takes lambda " +
                                 brief(scan.by_risk) + " here"});
    case LambdaCriterion::l_curve:
      break;
  }
  if (scan.by_l_curve) return *scan.by_l_curve;
  // but for the ends, where a spline knows no curvature
  const double largest = *std::max_element(scan.curvature.begin() + 2, scan.curvature.end() - 2);
  throw NotSolved({.reason = "the L-curve of these data has no corner (its largest curvature is " + brief(largest) +
                             ", a corner has " + brief(kLeastCurvature) +
                             " at least): set lambda_by = risk, which takes lambda " + brief(scan.by_risk) +
                             " here; it aims at the tractions, and needs no corner"});
}

}  // namespace mbtfm::inverse
