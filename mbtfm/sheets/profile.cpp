#include "mbtfm/sheets/profile.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "mbtfm/tensions/robust.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::sheets {

using tensions::LinearData;

namespace {

constexpr int kScanOfTwo = 60;  // of each of two stiffnesses; refined where it matters

using ProfileAt = std::function<Profile(double)>;

/// By golden section between the neighbours of the scan's least.
Line searched(const StiffnessRange& range, int n_steps, const ProfileAt& profile_at) {
  const double low = std::log(range.low), high = std::log(range.high);
  const auto place = [&](std::ptrdiff_t k) {
    return low + (high - low) * static_cast<double>(std::clamp<std::ptrdiff_t>(k, 0, n_steps)) / n_steps;
  };
  Line line;
  for (int k = 0; k <= n_steps; ++k) line.scan.push_back(profile_at(std::exp(place(k))));
  const auto least = std::ranges::min_element(line.scan, {}, &Profile::misfit) - line.scan.begin();
  double a = place(least - 1), b = place(least + 1);
  constexpr double kGolden = 0.6180339887498949, kClose = 1e-7;
  double x = b - kGolden * (b - a), y = a + kGolden * (b - a);
  double fx = profile_at(std::exp(x)).misfit, fy = profile_at(std::exp(y)).misfit;
  while (b - a > kClose) {
    if (fx < fy) {
      b = y;
      y = x;
      fy = fx;
      x = b - kGolden * (b - a);
      fx = profile_at(std::exp(x)).misfit;
    } else {
      a = x;
      x = y;
      fx = fy;
      y = a + kGolden * (b - a);
      fy = profile_at(std::exp(y)).misfit;
    }
  }
  line.best = profile_at(std::exp(0.5 * (a + b)));
  if (line.scan[least].misfit < line.best.misfit) line.best = line.scan[least];
  return line;
}

}  // namespace

VectorXd best_loads(const MatrixXd& H, const VectorXd& right, Index n_bundles) {
  VectorXd loads = numerics::solve_symmetric(H, right);
  if (n_bundles == 0 || loads.tail(n_bundles).minCoeff() >= 0) return loads;
  VectorXd low = VectorXd::Constant(loads.size(), -std::numeric_limits<double>::infinity());
  low.tail(n_bundles).setZero();
  return tensions::bounded_quadratic_minimum(H, -right, low);
}

tensions::Sides Profile::reach(Index load, double room) const {
  if (n_bundles == 0) {
    const double half = std::sqrt(room * numerics::inverse_symmetric(normal)(load, load));
    return {half, half};
  }
  // what may take both signs is given a bound that it never meets
  tensions::LocalMisfit local{.tensions_nN = loads, .H = normal, .g = gradient};
  for (Index k = 0; k < loads.size() - n_bundles; ++k)
    local.tensions_nN[k] = 1e3 * (std::abs(loads[k]) + std::sqrt(room / normal(k, k)));
  constexpr double kNormal95 = tensions::kNormal95;
  return tensions::profiles_95(local, room / (kNormal95 * kNormal95))[load];
}

Profile Search::at(const Stiffnesses& stiffnesses) const {
  const MatrixXd columns =
      tensions::displace(data_.reduced, numerics::small_product(table_.shares(stiffnesses), joined_));
  Profile profile{.at = stiffnesses,
                  .loads = {},
                  .misfit = 0,
                  .normal = numerics::small_transposed_product(columns, columns),
                  .gradient = {},
                  .n_bundles = n_bundles_};
  profile.loads = best_loads(profile.normal, numerics::transposed_matvec(columns, data_.reduced.target), n_bundles_);
  const VectorXd left = numerics::matvec(columns, profile.loads) - data_.reduced.target;
  profile.misfit = left.squaredNorm();
  profile.gradient = numerics::transposed_matvec(columns, left);
  return profile;
}

Line Search::over_sheet(std::optional<double> adhesion) const {
  if (known_) {
    const Profile only = at({*known_, adhesion});
    return {{only}, only};
  }
  return searched(table_.sheet_nN_per_um(), table_.adhesion_nN_per_um3() ? kScanOfTwo : kScan, [&](double M) {
    return at({M, adhesion});
  });
}

Line Search::over_adhesion() const {
  return searched(*table_.adhesion_nN_per_um3(), kScanOfTwo, [&](double kappa) { return over_sheet(kappa).best; });
}

Line Search::over_sheet_with_best_adhesion() const {
  return searched(table_.sheet_nN_per_um(), kScanOfTwo, [&](double M) {
    return searched(*table_.adhesion_nN_per_um3(), kScanOfTwo, [&](double kappa) { return at({M, kappa}); }).best;
  });
}

Profile Search::best() const {
  return table_.adhesion_nN_per_um3() ? over_adhesion().best : over_sheet(table_.known_adhesion_nN_per_um3()).best;
}

MatrixXd of_even_parts(const StiffnessTable& table) {
  const Index n = table.n_contractions(), n_others = table.n_loads() - n;
  MatrixXd joined = MatrixXd::Zero(n + n_others, 1 + n_others);
  joined.topLeftCorner(n, 1).setOnes();
  joined.bottomRightCorner(n_others, n_others).setIdentity();
  return joined;
}

MatrixXd without_bundles(const StiffnessTable& table) {
  return MatrixXd::Identity(table.n_loads(), table.n_loads() - std::ssize(table.bundles()));
}

MatrixXd Directions::normal(const LinearData& data) const {
  const MatrixXd J = tensions::displace(data.reduced, forces(Eigen::all, unknown));
  return numerics::small_transposed_product(J, J);
}

MatrixXd Directions::normal_without_motion(const LinearData& data) const {
  const MatrixXd J = data.response->displace(forces(Eigen::all, unknown));
  return numerics::small_transposed_product(J, tensions::squared_weights(data).asDiagonal() * J);
}

Directions directions_about(const StiffnessTable& table, const Stiffnesses& at, const VectorXd& loads,
                            bool is_sheet_known) {
  constexpr double kStep = 1e-4;
  const auto forces = [&](double log_sheet, double log_adhesion) -> VectorXd {
    Stiffnesses moved = at;
    moved.sheet_nN_per_um *= std::exp(log_sheet);
    if (moved.adhesion_nN_per_um3) *moved.adhesion_nN_per_um3 *= std::exp(log_adhesion);
    return numerics::matvec(table.shares(moved), loads);
  };
  const Index n = table.n_loads(), first_bundle = n - std::ssize(table.bundles());
  Directions all{.forces = MatrixXd(table.shares(at).rows(), n + 2), .unknown = {}};
  all.forces << table.shares(at), (forces(kStep, 0) - forces(-kStep, 0)) / (2 * kStep),
      (forces(0, kStep) - forces(0, -kStep)) / (2 * kStep);
  for (Index k = 0; k < n; ++k)
    if (k < first_bundle || loads[k] > 0) all.unknown.push_back(k);
  if (!is_sheet_known) all.unknown.push_back(n);
  if (table.adhesion_nN_per_um3()) all.unknown.push_back(n + 1);
  return all;
}

namespace {

/// 0 of what is known.
MatrixXd padded(const MatrixXd& of_unknown, const Directions& about) {
  MatrixXd whole = MatrixXd::Zero(about.forces.cols(), about.forces.cols());
  whole(about.unknown, about.unknown) = of_unknown;
  return whole;
}

/// Of all directions; 0 of those that have none.
MatrixXd whole(const MatrixXd& prior, const Directions& about) {
  MatrixXd all = MatrixXd::Zero(about.forces.cols(), about.forces.cols());
  all.topLeftCorner(prior.rows(), prior.cols()) = prior;
  return all;
}

}  // namespace

Residuals residuals_of(const LinearData& data, const VectorXd& node_amplitudes, const Directions& about,
                       const MatrixXd& prior) {
  const VectorXd weight = tensions::squared_weights(data).cwiseSqrt();
  const MatrixXd J = weight.asDiagonal() *
                     tensions::less_motion(data, data.response->displace(about.forces(Eigen::all, about.unknown)));
  const MatrixXd A = numerics::small_transposed_product(J, J) + whole(prior, about)(about.unknown, about.unknown);
  const Index n_motions = data.motions.shapes.cols(), n = n_motions + J.cols();
  Residuals r{.position_um = data.position_um,
              .weighted = weight.cwiseProduct(tensions::residual_um(data, node_amplitudes)),
              .weight_per_um = weight,
              .followed = MatrixXd(J.rows(), n),
              .inverse = MatrixXd::Zero(n, n),
              .has_errors = data.has_errors};
  if (n_motions > 0) {
    r.followed.leftCols(n_motions) = weight.asDiagonal() * data.motions.shapes;
    r.inverse.topLeftCorner(n_motions, n_motions) = data.motions.inverse;
  }
  r.followed.rightCols(J.cols()) = J;
  r.inverse.bottomRightCorner(J.cols(), J.cols()) = numerics::inverse_symmetric(A);
  for (Index b = 0; b < data.bead_weight.size(); ++b)
    if (data.weight_per_um(2 * b) > 0) r.degrees += 2 * data.bead_weight(b);
  r.degrees -= r.inverse.cwiseProduct(numerics::small_transposed_product(r.followed, r.followed)).sum();
  return r;
}

Linearised linearised(const LinearData& data, const Directions& about, double variance, const MatrixXd& prior) {
  const MatrixXd of_prior = whole(prior, about);
  const auto solved = [&](const Directions& of) -> MatrixXd {
    return padded(numerics::inverse_symmetric(of.normal(data) + of_prior(of.unknown, of.unknown)), of);
  };
  const MatrixXd inverse = solved(about);
  // a stiffness that the beads do not determine within a factor of e follows no straight line
  Directions resolved = about;
  const Index n_loads = about.forces.cols() - 2;
  std::erase_if(resolved.unknown, [&](Index k) { return k >= n_loads && variance * inverse(k, k) > 1; });
  const MatrixXd forces = numerics::small_product(about.forces, solved(resolved));
  return {.covariance = variance * inverse,
          .without_motion = variance * padded(numerics::inverse_symmetric(about.normal_without_motion(data) +
                                                                          of_prior(about.unknown, about.unknown)),
                                              about),
          .answers = tensions::less_motion(data, data.response->displace(forces)).transpose() *
                     tensions::squared_weights(data).asDiagonal()};
}

FittedEstimate fitted_estimate(SheetEstimate estimate, double variance, VectorXd by_unknown) {
  estimate.identifiable = estimate.low && estimate.high;
  if (estimate.identifiable) estimate.sigma = std::sqrt(std::max(0.0, variance));
  return {std::move(estimate), std::move(by_unknown)};
}

void split_by_noise(std::vector<FittedEstimate>& estimates, const Linearised& about, double variance,
                    const LinearData& data) {
  const double by_beads = data.has_errors ? std::min(1.0, tensions::noise_variance(data) / variance) : 1;
  for (FittedEstimate& e : estimates) {
    if (!e.sigma) continue;
    const double whole = numerics::quadratic_form(about.covariance, e.by_unknown),
                 without = numerics::quadratic_form(about.without_motion, e.by_unknown);
    const double by_motion = whole > 0 ? std::clamp(1 - without / whole, 0.0, 1.0) : 0;
    e.parts.beads = *e.sigma * std::sqrt(by_beads * (1 - by_motion));
    if (data.motions.shapes.cols() > 0) e.parts.motion = *e.sigma * std::sqrt(by_beads * by_motion);
    e.parts.model = *e.sigma * std::sqrt(1 - by_beads);
  }
}

LinearData weighed(LinearData data, tensions::Loss loss, const std::function<VectorXd(const LinearData&)>& amplitudes) {
  if (loss == tensions::Loss::squares) return data;
  constexpr int kMost = 30;
  constexpr double kSettled = 1e-3;
  double scale = 0;
  for (const tensions::Loss step : inverse::in_turn(loss)) {
    double change = 1;
    for (int round = 0; round < kMost && change > kSettled; ++round) {
      const VectorXd residual = tensions::weighted_residual(data, amplitudes(data));
      if (step != tensions::Loss::tukey || round == 0) scale = tensions::robust_scale(data, residual);
      if (!(scale > 0)) break;
      const VectorXd weight = inverse::weights_of(step, residual, scale, 2);
      change = (weight - data.bead_weight).cwiseAbs().maxCoeff();
      data = tensions::reweighted(std::move(data), weight);
    }
  }
  return data;
}

void add_misfit(SheetFit& fit, const LinearData& data, VectorXd node_amplitudes, double n_unknowns) {
  fit.node_amplitudes = std::move(node_amplitudes);
  fit.relative_l2 = tensions::relative_l2(data, fit.node_amplitudes);
  fit.n_beads = static_cast<int>(data.position_um.size());
  fit.n_down_weighted = static_cast<int>((data.bead_weight.array() < 0.5).count());
  if (!data.has_errors) return;
  // over the same displacements as relative_l2: those less the motion that is found with the sheet
  const VectorXd u_um =
      tensions::moved_by(data, fit.node_amplitudes) + tensions::residual_um(data, fit.node_amplitudes);
  double u_squared = 0, noise_squared = 0, n_components = 0;
  for (Index k = 0; k < u_um.size(); ++k) {
    if (!(data.weight_per_um(k) > 0)) continue;
    u_squared += u_um(k) * u_um(k);
    noise_squared += 1 / (data.weight_per_um(k) * data.weight_per_um(k));
    ++n_components;
  }
  const double degrees = static_cast<double>(data.n_used) - n_unknowns;
  if (u_squared > 0) fit.expected_relative_l2 = std::sqrt(noise_squared * degrees / n_components / u_squared);
}

Models::Models(const LinearData& data, double noise_variance)
    : data_(data), noise_(std::max(noise_variance, std::numeric_limits<double>::min())) {
  all_.push_back(tensions::score_of(
      "nothing", 0, (data.reduced.target.squaredNorm() + data.reduced.floor_squared) / noise_, 1, data));
}

void Models::add(const std::string& name, Index n_parameters, const VectorXd& amplitudes) {
  const VectorXd left = tensions::displace(data_.reduced, amplitudes) - data_.reduced.target;
  all_.push_back(tensions::score_of(name, n_parameters, (left.squaredNorm() + data_.reduced.floor_squared) / noise_,
                                    tensions::relative_l2(data_, amplitudes), data_));
  all_.back().left_um = data_.displacement_um - data_.response->displace(amplitudes);
}

}  // namespace mbtfm::sheets
