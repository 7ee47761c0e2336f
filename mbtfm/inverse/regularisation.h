/// How much to smooth: lambda from the data, by several criteria at once.
/// docs/theory/reconstructions.md, (11) to (15b).
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/words.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::inverse {

/// The minimum of |u − G t|² + lambda² |t|² for one lambda, in the weights that the data carry.
struct ScanPoint {
  double lambda = 0;   ///< in the method's own unit
  double misfit = 0;   ///< |u − G t|²
  double norm = 0;     ///< |t|²
  double degrees = 0;  ///< trace of the matrix that takes u to G t: how many data the tractions use up
};

/// The scan with its criteria; each array by point.
struct LambdaScan {
  std::vector<ScanPoint> points;  ///< evenly spaced in log lambda, falling
  std::vector<double> gcv;        ///< (12), to be small
  std::vector<double> curvature;  ///< of the L-curve (13), to be large
  std::vector<double> evidence;   ///< logarithm, less its largest (14), to be large
  std::vector<double> risk;       ///< expected |t − true|² but for a constant, (15) or (15b), to be small
  double by_gcv = 0, by_evidence = 0, by_risk = 0;  ///< lambda by each
  double by_prediction = 0;                         ///< of the least expected |G t − G true|² (25b)
  std::optional<double> by_l_curve;                 ///< none where the curve has no corner
  std::optional<double> by_discrepancy;             ///< none where the data state no errors, or are fitted worse
  double variance = 0;                              ///< of one datum, that the risk was found with
  std::string variance_source;
};

enum class LambdaCriterion { risk, gcv, l_curve, evidence, discrepancy };
constexpr auto words(LambdaCriterion) { return std::array{"risk", "gcv", "l-curve", "evidence", "discrepancy"}; }

/// Expected |t − true|² of each point, up to a constant. @param variance  of one datum
using Risks = std::function<std::vector<double>(const std::vector<ScanPoint>&, double variance)>;
/// (15) of one point. @param misfit, n_data  of the data that tractions can follow: the others do not enter the risk
double unbiased_risk(const ScanPoint& point, double misfit, double n_data, double variance);
/// (15), where tractions can follow all data.
Risks unbiased_risks(double n_data);

/// @param points           at least 5, evenly spaced in log lambda, falling
/// @param n_data           components of displacement
/// @param stated_variance  of one datum in the same weights, where the data state their errors
/// @param variance_left_at what the residual for one lambda shows of the same: robust_variance()
LambdaScan judge(std::vector<ScanPoint> points, double n_data, std::optional<double> stated_variance,
                 const std::function<double(double lambda)>& variance_left_at, const Risks& risks);

/// By point, log det(1 + G Gᵀ / lambda²) but for a constant: d log det / d log lambda² = −degrees.
std::vector<double> log_determinants_of(const std::vector<ScanPoint>& points);

/// The data's variance from residuals: their median magnitude, which the few that the model cannot follow do not move,
/// over what is left of Gaussian noise where the tractions have followed it, tr (1 − H)² of n.
double robust_variance(const VectorXd& residuals, double degrees, double degrees_of_square);

/// @throws NotSolved where the criterion is the L-curve and has no corner, or the discrepancy and the misfit never is
///         what the stated errors leave; it says which criterion to take
double chosen_lambda(const LambdaScan& scan, LambdaCriterion criterion);

/// Quantities of the scan between its points too, as the criteria see them: by splines through to(value).
struct Refinement {
  std::vector<double> lambdas;
  explicit Refinement(const std::vector<ScanPoint>& points);
  std::vector<double> of(const std::vector<double>& values, const std::function<double(double)>& to,
                         const std::function<double(double)>& from) const;
};
/// How the risk is brought to a scale on which a spline follows it: far from its least it grows by powers of ten.
struct RiskScale {
  double least = 0, depth = 1;
  explicit RiskScale(const std::vector<double>& risk);
  double to(double risk) const;
  double from(double tamed) const;
};

/// Lambdas from `largest` down to `smallest`, some in each decade.
std::vector<double> lambdas_between(double largest, double smallest);

}  // namespace mbtfm::inverse
