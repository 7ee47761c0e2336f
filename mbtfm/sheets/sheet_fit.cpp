#include "mbtfm/sheets/sheet_fit.h"

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "mbtfm/tensions/intervals.h"
#include "mbtfm/tensions/robust.h"
#include "substrate/loads.h"
#include "substrate/response.h"

namespace mbtfm::sheets {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using tensions::LinearData;

constexpr int kScan = 400;  // steps of log M over nine e-folds: 2 %, far below any standard error

/// At one stiffness: the best loads.
struct Profile {
  double stiffness = 0;
  VectorXd loads;
  double misfit = 0;  ///< |C R − y|², without the floor
  MatrixXd normal;    ///< of the loads
};

/// @param joined  the loads that are fitted as one: loads × fewer
Profile profile_at(const LinearData& data, const StiffnessTable& table, double stiffness, const MatrixXd& joined) {
  const MatrixXd columns = tensions::displace(data.reduced, table.shares(stiffness) * joined);
  Profile profile{.stiffness = stiffness, .loads = {}, .misfit = 0, .normal = columns.transpose() * columns};
  profile.loads = profile.normal.ldlt().solve(columns.transpose() * data.reduced.target);
  profile.misfit = (columns * profile.loads - data.reduced.target).squaredNorm();
  return profile;
}

Profile profile_at(const LinearData& data, const StiffnessTable& table, double stiffness) {
  return profile_at(data, table, stiffness, MatrixXd::Identity(table.n_loads(), table.n_loads()));
}

/// Of a sheet whose parts all contract alike: the least over the scanned stiffnesses.
double even_misfit(const LinearData& data, const StiffnessTable& table, const std::vector<Profile>& scan) {
  const Eigen::Index n = table.n_contractions(), n_others = table.n_loads() - n;
  MatrixXd joined = MatrixXd::Zero(n + n_others, 1 + n_others);
  joined.topLeftCorner(n, 1).setOnes();
  joined.bottomRightCorner(n_others, n_others).setIdentity();
  double least = std::numeric_limits<double>::infinity();
  for (const Profile& p : scan) least = std::min(least, profile_at(data, table, p.stiffness, joined).misfit);
  return least;
}

/// @param known  the stiffness; unset: all of the table
std::vector<Profile> scanned(const LinearData& data, const StiffnessTable& table, std::optional<double> known) {
  if (known) return {profile_at(data, table, *known)};
  const double low = std::log(table.softest_nN_per_um()), high = std::log(table.stiffest_nN_per_um());
  std::vector<Profile> profiles;
  for (int k = 0; k <= kScan; ++k)
    profiles.push_back(profile_at(data, table, std::exp(low + (high - low) * k / kScan)));
  return profiles;
}

/// Golden section between the neighbours of the scan's least.
Profile least(const LinearData& data, const StiffnessTable& table, const std::vector<Profile>& scan) {
  if (scan.size() == 1) return scan.front();
  const auto best = std::ranges::min_element(scan, {}, &Profile::misfit) - scan.begin();
  const auto at = [&](std::ptrdiff_t k) {
    return std::log(scan[static_cast<std::size_t>(std::clamp<std::ptrdiff_t>(k, 0, std::ssize(scan) - 1))].stiffness);
  };
  double a = at(best - 1), b = at(best + 1);
  constexpr double kGolden = 0.6180339887498949;
  double x = b - kGolden * (b - a), y = a + kGolden * (b - a);
  double fx = profile_at(data, table, std::exp(x)).misfit, fy = profile_at(data, table, std::exp(y)).misfit;
  while (b - a > 1e-9) {
    if (fx < fy) {
      b = y;
      y = x;
      fy = fx;
      x = b - kGolden * (b - a);
      fx = profile_at(data, table, std::exp(x)).misfit;
    } else {
      a = x;
      x = y;
      fx = fy;
      y = a + kGolden * (b - a);
      fy = profile_at(data, table, std::exp(y)).misfit;
    }
  }
  const Profile refined = profile_at(data, table, std::exp(0.5 * (a + b)));
  return refined.misfit < scan[static_cast<std::size_t>(best)].misfit ? refined : scan[static_cast<std::size_t>(best)];
}

/// Of the loads and log M, by the derivatives at the solution.
/// @param is_known  M: it has no error
MatrixXd covariance_of(const LinearData& data, const StiffnessTable& table, const Profile& best, double variance,
                       bool is_known) {
  constexpr double kStep = 1e-4;  // of log M: the table is a polynomial of it
  const auto displaced = [&](double log_factor) -> VectorXd {
    return tensions::displace(data.reduced, table.shares(best.stiffness * std::exp(log_factor))) * best.loads;
  };
  MatrixXd covariance = MatrixXd::Zero(table.n_loads() + 1, table.n_loads() + 1);
  if (is_known) {
    covariance.topLeftCorner(table.n_loads(), table.n_loads()) = variance * best.normal.inverse();
    return covariance;
  }
  MatrixXd J(data.reduced.target.size(), table.n_loads() + 1);
  J.leftCols(table.n_loads()) = tensions::displace(data.reduced, table.shares(best.stiffness));
  J.rightCols(1) = (displaced(kStep) - displaced(-kStep)) / (2 * kStep);
  return variance * (J.transpose() * J).ldlt().solve(MatrixXd::Identity(J.cols(), J.cols()));
}

/// The range of a quantity over all stiffnesses that the beads do not exclude. At each stiffness a load may lie so far
/// from its best as the misfit has room left.
struct Limits {
  double low = std::numeric_limits<double>::infinity(), high = -std::numeric_limits<double>::infinity();
  bool is_open_below = false, is_open_above = false;  ///< the table ends before the beads set a limit
  void take(double a, double b) {
    low = std::min({low, a, b});
    high = std::max({high, a, b});
  }
};

template <class Body>
void for_each_allowed(const std::vector<Profile>& scan, const Profile& best, double variance, const Body& body) {
  const double room = tensions::kNormal95 * tensions::kNormal95 * variance;
  for (const Profile& p : scan)
    if (p.misfit - best.misfit <= room) body(p, std::sqrt(room - std::max(0.0, p.misfit - best.misfit)));
  body(best, std::sqrt(room));
}

double spread_of(const Profile& p, Eigen::Index load) { return std::sqrt(p.normal.inverse()(load, load)); }

Limits limits_of_load(const std::vector<Profile>& scan, const Profile& best, double variance, Eigen::Index load,
                      bool over_stiffness) {
  Limits limits;
  for_each_allowed(scan, best, variance, [&](const Profile& p, double room) {
    const double scale = over_stiffness ? 1 / p.stiffness : 1, reach = room * spread_of(p, load);
    limits.take(scale * (p.loads(load) - reach), scale * (p.loads(load) + reach));
  });
  return limits;
}

/// Where the misfit crosses its limit to both sides, between two steps of the scan.
Limits limits_of_stiffness(const std::vector<Profile>& scan, const Profile& best, double variance) {
  const double limit = best.misfit + tensions::kNormal95 * tensions::kNormal95 * variance;
  const bool is_known = scan.size() == 1;
  Limits limits{.is_open_below = !is_known && scan.front().misfit <= limit,
                .is_open_above = !is_known && scan.back().misfit <= limit};
  limits.take(best.stiffness, best.stiffness);
  for (std::size_t k = 0; k + 1 < scan.size(); ++k) {
    const Profile &a = scan[k], &b = scan[k + 1];
    if (a.misfit <= limit) limits.take(a.stiffness, a.stiffness);
    if (b.misfit <= limit) limits.take(b.stiffness, b.stiffness);
    if ((a.misfit <= limit) == (b.misfit <= limit)) continue;
    const double share = (limit - a.misfit) / (b.misfit - a.misfit);
    const double edge = std::exp(std::log(a.stiffness) + share * std::log(b.stiffness / a.stiffness));
    limits.take(edge, edge);
  }
  return limits;
}

SheetEstimate estimate(Quantity quantity, const std::string& part, double value, double sigma, const Limits& limits) {
  SheetEstimate e{
      .quantity = quantity, .part = part, .value = value, .sigma = sigma, .low = limits.low, .high = limits.high};
  if (limits.is_open_below) e.low = std::nullopt;
  if (limits.is_open_above) e.high = std::nullopt;
  e.identifiable = e.low && e.high;
  if (!e.identifiable) e.sigma = std::nullopt;
  return e;
}

/// Weights of the beads by a robust loss, until they stay.
/// @param fixed_scale  unset: the middle of the residuals, anew each time
LinearData weighed(LinearData data, const StiffnessTable& table, tensions::Loss loss, std::optional<double> known,
                   std::optional<double> fixed_scale) {
  constexpr int kMost = 30;
  for (int k = 0; k < kMost; ++k) {
    const Profile best = least(data, table, scanned(data, table, known));
    const VectorXd residual = tensions::weighted_residual(data, table.shares(best.stiffness) * best.loads);
    const double scale = fixed_scale.value_or(tensions::robust_scale(data, residual));
    if (!(scale > 0)) break;
    VectorXd weight(residual.size() / 2);
    for (Eigen::Index b = 0; b < weight.size(); ++b)
      weight(b) = tensions::robust_weight(loss, residual.segment<2>(2 * b).norm() / scale);
    const double change = (weight - data.bead_weight).cwiseAbs().maxCoeff();
    data = tensions::reweighted(std::move(data), weight);
    if (change < 1e-3) break;
  }
  return data;
}

/// Tukey's loss has several minima: it starts from Huber's, whose scale it keeps.
LinearData weighed(LinearData data, const StiffnessTable& table, tensions::Loss loss, std::optional<double> known) {
  if (loss == tensions::Loss::squares) return data;
  if (loss != tensions::Loss::tukey) return weighed(std::move(data), table, loss, known, std::nullopt);
  data = weighed(std::move(data), table, tensions::Loss::huber, known, std::nullopt);
  const Profile best = least(data, table, scanned(data, table, known));
  const double scale =
      tensions::robust_scale(data, tensions::weighted_residual(data, table.shares(best.stiffness) * best.loads));
  return weighed(std::move(data), table, loss, known, scale);
}

}  // namespace

LinearData data_of(const DisplacementField& beads, const StiffnessTable& table, const sheet::OnGel& ground,
                   const substrate::Substrate& gel, int threads) {
  std::vector<Vec2> points;
  for (const Bead& bead : beads) points.push_back(bead.position_um);
  const auto response = gel.response({ground.patches(), 2}, {points});
  return tensions::reduce(beads, substrate::dense_response(response->displace(table.forces_nN()), threads), {},
                          threads);
}

SheetFit fit_sheet(LinearData data, const StiffnessTable& table, tensions::Loss loss, std::optional<double> known,
                   const std::vector<std::string>& parts) {
  data = weighed(std::move(data), table, loss, known);
  const Eigen::Index n_unknowns = table.n_loads() + (known ? 0 : 1);
  const std::vector<Profile> scan = scanned(data, table, known);
  const Profile best = least(data, table, scan);
  SheetFit fit;
  fit.stiffness_nN_per_um = best.stiffness;
  constexpr double kAtBound = 1e-4;  // of log M; the search ends at 1e-9
  fit.is_at_bound = !known && std::min(std::log(best.stiffness / table.softest_nN_per_um()),
                                       std::log(table.stiffest_nN_per_um() / best.stiffness)) < kAtBound;
  fit.loads = best.loads;
  fit.node_amplitudes = table.shares(best.stiffness) * best.loads;
  fit.variance = tensions::misfit_variance(data, fit.node_amplitudes, n_unknowns, loss);
  const MatrixXd covariance = covariance_of(data, table, best, fit.variance, known.has_value());
  const Eigen::Index at_M = table.n_loads();
  const auto sigma = [&](Eigen::Index k) { return std::sqrt(std::max(0.0, covariance(k, k))); };
  if (!known) fit.correlation = covariance(0, at_M) / (sigma(0) * sigma(at_M));
  const Limits of_M = limits_of_stiffness(scan, best, fit.variance);
  const double M = best.stiffness;
  fit.estimates = {estimate(Quantity::stiffness, {}, M, M * sigma(at_M), of_M)};
  for (Eigen::Index k = 0; k < table.n_contractions(); ++k) {
    Limits of_s = limits_of_load(scan, best, fit.variance, k, false),
           of_ratio = limits_of_load(scan, best, fit.variance, k, true);
    const double s = best.loads(k);
    const auto away_from_zero = s < 0 ? &Limits::is_open_below : &Limits::is_open_above;
    of_s.*away_from_zero = of_M.is_open_above;      // a stiff sheet pulls as its strain, s over M, has it
    of_ratio.*away_from_zero = of_M.is_open_below;  // a soft one as its contraction
    const std::string part = parts.empty() ? "" : parts[static_cast<std::size_t>(k)];
    // of s / M, where log M and s are correlated
    const double of_share =
        std::sqrt(std::max(0.0, covariance(k, k) + s * s * covariance(at_M, at_M) - 2 * s * covariance(k, at_M))) / M;
    fit.estimates.insert(fit.estimates.end() - (k == 0 ? 1 : 0),
                         estimate(Quantity::contraction, part, s, sigma(k), of_s));
    fit.estimates.push_back(estimate(Quantity::contraction_over_stiffness, part, s / M, of_share, of_ratio));
  }
  if (table.n_loads() > table.n_contractions())
    fit.estimates.push_back(estimate(Quantity::line_tension, {}, best.loads(at_M - 1), sigma(at_M - 1),
                                     limits_of_load(scan, best, fit.variance, at_M - 1, false)));
  fit.relative_l2 = tensions::relative_l2(data, fit.node_amplitudes);
  fit.n_beads = static_cast<int>(data.position_um.size());
  fit.n_down_weighted = static_cast<int>((data.bead_weight.array() < 0.5).count());
  const double u_squared = (data.weight_per_um.cwiseProduct(data.displacement_um)).squaredNorm();
  fit.expected_relative_l2 =
      data.has_errors ? std::sqrt(static_cast<double>(data.n_used - n_unknowns) / u_squared) : fit.relative_l2;
  const double noise = std::max(fit.variance, std::numeric_limits<double>::min());
  const auto model = [&](const std::string& name, int n_parameters, double chi_squared, double l2) {
    const double chi = chi_squared / noise;
    fit.models.push_back({name, n_parameters, chi, l2, chi + 2 * n_parameters,
                          chi + n_parameters * std::log(static_cast<double>(data.n_used))});
  };
  const double floor = data.reduced.floor_squared;
  model("nothing", 0, data.reduced.target.squaredNorm() + floor, 1);
  const bool has_parts = table.n_contractions() > 1;
  const std::string name = table.n_loads() > table.n_contractions() ? "sheet-with-line" : "sheet";
  if (has_parts) {
    const double even = even_misfit(data, table, scan) + floor;
    const double least = std::max(best.misfit + floor, std::numeric_limits<double>::min());
    model(name, static_cast<int>(n_unknowns) - table.n_contractions() + 1, even,
          fit.relative_l2 * std::sqrt(even / least));
  }
  model(has_parts ? name + "-in-parts" : name, static_cast<int>(n_unknowns), best.misfit + floor, fit.relative_l2);
  fit.report = {.converged = true, .iterations = kScan, .last_change = 0, .reason = "scanned over the stiffness"};
  return fit;
}

std::vector<SheetEstimate> expanding(const SheetFit& fit) {
  std::vector<SheetEstimate> found;
  for (const SheetEstimate& e : fit.estimates) {
    if (e.quantity == Quantity::contraction && (e.value < 0 || (e.high && *e.high < 0))) found.push_back(e);
  }
  return found;
}

void compare_with_adhesions(SheetFit& fit, const LinearData& adhesions) {
  const double noise = tensions::noise_variance(adhesions), old_noise = fit.variance;
  const auto n_used = static_cast<double>(adhesions.n_used);
  fit.models.push_back({"adhesion-forces", static_cast<int>(adhesions.reduced.n_felt),
                        adhesions.reduced.floor_squared / old_noise,
                        tensions::relative_l2(adhesions, tensions::free_forces_nN(adhesions.reduced)), 0, 0});
  for (SheetModel& model : fit.models) {
    model.chi_squared *= old_noise / noise;
    model.aic = model.chi_squared + 2 * model.n_parameters;
    model.bic = model.chi_squared + model.n_parameters * std::log(n_used);
  }
}

}  // namespace mbtfm::sheets
