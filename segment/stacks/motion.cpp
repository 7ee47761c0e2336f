#include "segment/stacks/motion.h"

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <optional>

#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/order_statistics.h"
#include "segment/stacks/mean_by_depth.h"

namespace mbtfm::stacks {
namespace {

using Eigen::Index;
using Eigen::MatrixX2d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

MatrixXd of_gel(const MeanByDepth& mean, double length_um) {
  const auto n = static_cast<Index>(mean.z_um.size());
  MatrixXd covariance(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      const double apart = (mean.z_um[i] - mean.z_um[j]) / length_um;
      covariance(i, j) = mean.field_um[i] * mean.field_um[j] * std::exp(-0.5 * apart * apart);
    }
    covariance(i, i) += mean.field_um[i] * mean.field_um[i] / std::max(1.0, mean.beads_by_place[i]);
  }
  return covariance;
}

/// A walk begins anywhere: the shift is free.
MatrixXd of_stage(Index n, double steps, double jitter) {
  MatrixXd covariance(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) covariance(i, j) = steps * static_cast<double>(std::min(i, j));
  }
  covariance.diagonal().array() += jitter;
  return covariance;
}

struct Model {
  MatrixXd stage;
  Eigen::LLT<MatrixXd> whole;
  VectorXd of_shift;     ///< C⁻¹ 1
  double precision = 0;  ///< 1ᵀ C⁻¹ 1
  Vector2d shift_um;
  MatrixX2d weighed;          ///< C⁻¹ (mean − shift)
  double log_likelihood = 0;  ///< restricted, of both components
};

Model model_of(const MeanByDepth& mean, const MatrixXd& still, MatrixXd stage) {
  const Index n = still.rows();
  Model m;
  m.stage = std::move(stage);
  m.whole.compute(still + m.stage);
  m.of_shift = m.whole.solve(VectorXd::Ones(n));
  m.precision = m.of_shift.sum();
  m.shift_um = (m.of_shift.transpose() * mean.um).transpose() / m.precision;
  const MatrixX2d left = mean.um.rowwise() - m.shift_um.transpose();
  m.weighed = m.whole.solve(left);
  const double log_determinant = 2 * m.whole.matrixLLT().diagonal().array().log().sum();
  m.log_likelihood = -log_determinant - std::log(m.precision) - 0.5 * left.cwiseProduct(m.weighed).sum();
  return m;
}

}  // namespace

StageByDepth stage_by_depth(const MeanByDepth& mean, bool may_drift) {
  const auto n = static_cast<Index>(mean.z_um.size());
  const double range_um = std::max(1e-9, mean.z_um.back() - mean.z_um.front());
  // a floor for the factorisation, far below any bead's error
  const MatrixXd noise = mean.noise_um2 + 1e-12 * MatrixXd::Identity(n, n);
  std::optional<Model> still, moving;
  const auto better = [](std::optional<Model>& old, Model&& other) {
    if (!old || other.log_likelihood > old->log_likelihood) old = std::move(other);
  };
  for (const double parts : {2, 4, 8, 16}) {
    const MatrixXd without = of_gel(mean, range_um / parts) + noise;
    better(still, model_of(mean, without, MatrixXd::Zero(n, n)));
    if (!may_drift) continue;
    // standard deviations from a nanometre on, by factors of three
    constexpr double kLeast_um = 1e-3;
    constexpr int kFactors = 7;
    for (int steps = -1; steps < kFactors; ++steps) {
      for (int jitter = steps < 0 ? 0 : -1; jitter < kFactors; ++jitter) {
        const auto variance = [&](int k) { return k < 0 ? 0.0 : std::pow(kLeast_um * std::pow(3, k), 2); };
        better(moving, model_of(mean, without, of_stage(n, variance(steps), variance(jitter))));
      }
    }
  }
  const Model& model = moving ? *moving : *still;
  StageByDepth result;
  // the least steps that are tried may fit worse than none
  result.log_likelihood_gain = std::max(0.0, model.log_likelihood - still->log_likelihood);
  result.um = (model.stage * model.weighed).rowwise() + model.shift_um.transpose();
  // cov(stage + shift − theirs) = D − D C⁻¹ D + (1 − D C⁻¹ 1)(1 − D C⁻¹ 1)ᵀ / 1ᵀ C⁻¹ 1
  const VectorXd remote = VectorXd::Ones(n) - model.stage * model.of_shift;
  const MatrixXd covariance =
      model.stage - model.stage * model.whole.solve(model.stage) + remote * remote.transpose() / model.precision;
  result.sigma_um = covariance.diagonal().cwiseMax(0).cwiseSqrt();
  result.shift_um = result.um.colwise().mean().transpose();
  result.shift_sigma_um = std::sqrt(std::max(0.0, covariance.mean()));
  result.drift_um = result.um.rowwise() - result.shift_um.transpose();
  const VectorXd with_shift = covariance.rowwise().mean();
  result.drift_sigma_um = ((covariance.diagonal() - 2 * with_shift).array() + covariance.mean()).cwiseMax(0).sqrt();
  return result;
}

namespace {

/// The two places along z between which a bead lies, and its shares of them.
struct Between {
  Index place[2];
  double share[2];
};
Between between(const std::vector<double>& z, double at) {
  const auto last = static_cast<Index>(z.size()) - 1;
  if (last == 0 || at <= z.front()) return {{0, std::min<Index>(1, last)}, {1, 0}};
  if (at >= z.back()) return {{last - 1, last}, {0, 1}};
  const auto above = static_cast<Index>(std::ranges::upper_bound(z, at) - z.begin());
  const double share = (at - z[above - 1]) / (z[above] - z[above - 1]);
  return {{above - 1, above}, {1 - share, share}};
}

/// The slices that see beads, or every second one, every third one …: ten beads for each at least.
std::vector<double> places_along_z(const std::vector<Moved>& beads, const Slices& slices) {
  constexpr double kBeads = 10, kMost = 250;
  double low = beads[0].place_um.z, high = low;
  for (const Moved& bead : beads) low = std::min(low, bead.place_um.z), high = std::max(high, bead.place_um.z);
  const double most = std::clamp(static_cast<double>(beads.size()) / kBeads, 1.0, kMost);
  const double least = std::max(1e-9, (high - low) / most);
  const double step = slices.step_um > 0 ? slices.step_um * std::ceil(least / slices.step_um) : least;
  const double first = slices.first_um + step * std::floor((low - slices.first_um) / step);
  std::vector<double> places;
  for (int k = 0; places.empty() || places.back() < high; ++k) places.push_back(first + k * step);
  return places;
}

/// The unknowns: turn, shift along z, then x and y for each place along z.
struct Fit {
  VectorXd solution;
  MatrixXd covariance;
  std::vector<double> weights;
  double scale = 1;  ///< of the beads at rest over their standard errors
};

/// What a bead's motion along x, y and z is of the unknowns: three columns each, and their factors.
struct Rows {
  Index at[3][3];
  double of[3][3];
  /// What they leave of the bead's motion.
  Eigen::Vector3d left(Vec3 u, const VectorXd& solution) const {
    Eigen::Vector3d rest(u.x, u.y, u.z);
    for (int c = 0; c < 3; ++c)
      for (int p = 0; p < 3; ++p) rest[c] -= of[c][p] * solution[at[c][p]];
    return rest;
  }
};

Rows rows_of(const Moved& bead, const std::vector<double>& z, Vec3 centre) {
  const Vec3 d = bead.place_um - centre;
  const auto [place, share] = between(z, bead.place_um.z);
  const Index low = 2 + 2 * place[0], high = 2 + 2 * place[1];
  return {{{0, low, high}, {0, low + 1, high + 1}, {1, 1, 1}},
          {{-d.y, share[0], share[1]}, {d.x, share[0], share[1]}, {1, 0, 0}}};
}

Fit fitted(const std::vector<Moved>& beads, const std::vector<double>& z, Vec3 centre) {
  const auto n_places = static_cast<Index>(z.size());
  const Index n = 2 + 2 * n_places;
  Fit fit{.solution = VectorXd::Zero(n), .covariance = {}, .weights = {}};
  std::vector<double> x, y, along, sigmas, sigmas_z;
  std::vector<Rows> rows;
  for (const Moved& b : beads) {
    x.push_back(b.displacement_um.x), y.push_back(b.displacement_um.y), along.push_back(b.displacement_um.z);
    sigmas.push_back(b.sigma_um), sigmas_z.push_back(b.sigma_z_um);
    rows.push_back(rows_of(b, z, centre));
  }
  const double mx = numerics::median(x), my = numerics::median(y);
  fit.solution[1] = numerics::median(along);
  for (Index k = 0; k < n_places; ++k) fit.solution[2 + 2 * k] = mx, fit.solution[3 + 2 * k] = my;
  const double unit = std::max(1e-6, numerics::median(sigmas)), unit_z = std::max(1e-6, numerics::median(sigmas_z));
  const Eigen::Array3d certainty = Eigen::Array3d(unit, unit, unit_z).square().inverse();
  fit.weights.assign(beads.size(), 0);
  constexpr int kRounds = 15;
  double scale = 0;
  for (int round = 0; round < kRounds; ++round) {
    MatrixXd normal = MatrixXd::Zero(n, n);
    VectorXd right = VectorXd::Zero(n);
    std::vector<Eigen::Vector3d> left;
    std::vector<double> sizes;
    for (std::size_t b = 0; b < beads.size(); ++b) {
      left.push_back(rows[b].left(beads[b].displacement_um, fit.solution));
      sizes.push_back(std::sqrt((left[b].array().square() * certainty).sum()));
    }
    // the quietest third of three normal components lies below 1.24 standard deviations
    scale = std::max(1.0, numerics::quantile(sizes, 1.0 / 3) / 1.24);
    for (std::size_t b = 0; b < beads.size(); ++b) {
      const double r = sizes[b] / (6 * scale);  // three components: 4.685 for one
      fit.weights[b] = r < 1 ? (1 - r * r) * (1 - r * r) : 0;
      const auto& [at, of] = rows[b];
      for (int c = 0; c < 3; ++c)
        for (int p = 0; p < 3; ++p) {
          const double weighted = fit.weights[b] * certainty[c] * of[c][p];
          right[at[c][p]] += weighted * left[b][c];
          for (int q = 0; q < 3; ++q) normal(at[c][p], at[c][q]) += weighted * of[c][q];
        }
    }
    // places that no bead at rest sees take after their neighbours: a bead's worth of smoothness
    const double stiff = 1 / (unit * unit);
    for (Index k = 2; k + 2 < n; ++k) {
      const double step = fit.solution[k + 2] - fit.solution[k];
      normal(k, k) += stiff, normal(k + 2, k + 2) += stiff;
      normal(k, k + 2) -= stiff, normal(k + 2, k) -= stiff;
      right[k] += stiff * step, right[k + 2] -= stiff * step;
    }
    normal.diagonal().array() *= 1 + 1e-9;
    normal.diagonal().array() += 1e-12;
    fit.solution += numerics::solve_symmetric(normal, right);
    fit.scale = scale;
    if (round + 1 == kRounds) fit.covariance = scale * scale * numerics::inverse_symmetric(normal);
  }
  return fit;
}

/// How far single beads are off the mean motion at their depth, root mean square of a component without the noise.
struct Scatter {
  std::vector<double> across_um, along_um;  ///< by place
};

Scatter scatter_by_depth(const std::vector<Moved>& beads, const std::vector<double>& z, Vec3 centre, const Fit& fit) {
  struct Off {
    double z, across, along, sigma, sigma_z;
  };
  std::vector<Off> all;
  for (const Moved& bead : beads) {
    const Eigen::Vector3d off = rows_of(bead, z, centre).left(bead.displacement_um, fit.solution);
    all.push_back({bead.place_um.z, std::hypot(off[0], off[1]), std::abs(off[2]), bead.sigma_um, bead.sigma_z_um});
  }
  std::ranges::sort(all, {}, &Off::z);
  Scatter scatter;
  for (const double place : z) {
    constexpr std::size_t kNear = 40;  // whose depths are nearest
    const std::size_t n = std::min(kNear, all.size());
    const auto above = static_cast<std::size_t>(std::ranges::lower_bound(all, place, {}, &Off::z) - all.begin());
    const std::size_t first = std::min(above - std::min(above, n / 2), all.size() - n);
    const auto median_of = [&](double Off::*member) {
      std::vector<double> values;
      for (std::size_t i = first; i < first + n; ++i) values.push_back(all[i].*member);
      return numerics::median(std::move(values));
    };
    const auto beyond = [](double spread, double sigma) {
      return std::sqrt(std::max(0.0, spread * spread - sigma * sigma));
    };
    // medians of a Rayleigh and of a folded normal variable
    scatter.across_um.push_back(beyond(median_of(&Off::across) / 1.1774, median_of(&Off::sigma)));
    scatter.along_um.push_back(beyond(median_of(&Off::along) / 0.6745, median_of(&Off::sigma_z)));
  }
  return scatter;
}

struct Means {
  MeanByDepth across, along;  ///< along z: both components the same
};

Means means_by_depth(const std::vector<Moved>& beads, const std::vector<double>& z, Vec3 centre, const Fit& fit) {
  const auto n = static_cast<Index>(z.size());
  Scatter scatter = scatter_by_depth(beads, z, centre, fit);
  VectorXd n_beads = VectorXd::Zero(n), weight = n_beads, sum_z_um = n_beads, noise_um2 = n_beads;
  for (std::size_t b = 0; b < beads.size(); ++b) {
    const Between at = between(z, beads[b].place_um.z);
    for (int p = 0; p < 2; ++p) {
      const double w = at.share[p] * fit.weights[b];
      n_beads[at.place[p]] += at.share[p];
      weight[at.place[p]] += w;
      sum_z_um[at.place[p]] += w * (beads[b].displacement_um.z - fit.solution[1]);
      noise_um2[at.place[p]] += w * beads[b].sigma_z_um * beads[b].sigma_z_um;
    }
  }
  const std::vector<double> by_place(n_beads.begin(), n_beads.end());
  Means means{.across = {z, Eigen::MatrixX2d(n, 2), MatrixXd(n, n), std::move(scatter.across_um), by_place},
              .along = {z, Eigen::MatrixX2d(n, 2), MatrixXd::Zero(n, n), std::move(scatter.along_um), by_place}};
  for (Index i = 0; i < n; ++i) {
    means.across.um.row(i) << fit.solution[2 + 2 * i], fit.solution[3 + 2 * i];
    for (Index j = 0; j < n; ++j) means.across.noise_um2(i, j) = fit.covariance(2 + 2 * i, 2 + 2 * j);
    const double seen = std::max(weight[i], 1e-3);  // a place without beads says nothing
    means.along.um.row(i).setConstant(fit.solution[1] + sum_z_um[i] / seen);
    means.along.noise_um2(i, i) = std::max(noise_um2[i] / seen, 1e-12) / seen;
  }
  return means;
}

/// What a bead's weight is above where it moves with the others: as far as standard errors explain it. Where more beads
/// move than two in three, the scale is that of these, and no measure of rest.
double weight_at_rest(double scale) {
  constexpr double kHalf = 0.5;    // (1 - r²)² of a bead at 4.2 standard errors, where the scale is theirs
  constexpr double kRaised = 1.5;  // what errors that are stated too small make of it: noise-understated
  const double r_squared = kHalf * std::pow(std::min(1.0, kRaised / scale), 2);
  return (1 - r_squared) * (1 - r_squared);
}

}  // namespace

Vec3 CommonMotion::at(Vec3 place_um) const {
  const Vec3 d = place_um - centre_um;
  return shift_um + Vec3{-turn_rad * d.y, turn_rad * d.x, 0} + drift_um_at(place_um.z);
}

Vec3 CommonMotion::drift_um_at(double at_um) const {
  if (!has_slice_drift || z_um.empty()) return {};
  const Between b = between(z_um, at_um);
  Vec3 u;
  for (int p = 0; p < 2; ++p) {
    const Vec2 drift = slices_um[b.place[p]];
    u += b.share[p] * Vec3{drift.x, drift.y, 0};
  }
  return u;
}

double CommonMotion::drift_sigma_um_at(double at_um) const {
  if (!has_slice_drift || z_um.empty()) return 0;
  const Between b = between(z_um, at_um);
  double sigma_um = 0;  // as if both places were off alike
  for (int p = 0; p < 2; ++p) sigma_um += b.share[p] * drift_sigma_um[b.place[p]];
  return sigma_um;
}

CommonMotion common_motion(const std::vector<Moved>& beads, Switch slice_drift, const Slices& slices) {
  CommonMotion motion;
  if (beads.empty()) return motion;
  for (const Moved& bead : beads) motion.centre_um += (1 / static_cast<double>(beads.size())) * bead.place_um;
  motion.z_um = places_along_z(beads, slices);
  const Fit fit = fitted(beads, motion.z_um, motion.centre_um);
  motion.turn_rad = fit.solution[0];
  motion.turn_sigma_rad = std::sqrt(std::max(0.0, fit.covariance(0, 0)));
  const auto at_rest = std::ranges::count_if(fit.weights, [&](double w) { return w > weight_at_rest(fit.scale); });
  motion.share_at_rest = static_cast<double>(at_rest) / static_cast<double>(beads.size());

  const Means means = means_by_depth(beads, motion.z_um, motion.centre_um, fit);
  StageByDepth across = stage_by_depth(means.across, slice_drift != Switch::off && motion.z_um.size() > 2);
  constexpr double kPays = 2;  // the gain is more than the stage's two variances cost: Akaike's criterion
  motion.slice_drift_ratio = std::sqrt(2 * across.log_likelihood_gain);
  motion.has_slice_drift =
      slice_drift == Switch::on || (slice_drift == Switch::automatic && motion.slice_drift_ratio > kPays);
  for (Index k = 0; k < across.um.rows(); ++k) {
    motion.slices_um.push_back({across.drift_um(k, 0), across.drift_um(k, 1)});
    motion.slices_sigma_um.push_back(across.sigma_um[k]);
    motion.drift_sigma_um.push_back(across.drift_sigma_um[k]);
  }
  if (!motion.has_slice_drift) across = stage_by_depth(means.across, false);
  const StageByDepth along = stage_by_depth(means.along, false);
  motion.shift_um = {across.shift_um.x(), across.shift_um.y(), along.shift_um.x()};
  motion.shift_sigma_um = {across.shift_sigma_um, across.shift_sigma_um, along.shift_sigma_um};
  return motion;
}

}  // namespace mbtfm::stacks
