#include "substrate/surface/beads.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/report.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::surface {
namespace {

using Eigen::VectorXd;

/// Rectangles about as wide as beads lie apart, over all of them; and the density that says so.
std::pair<Lattice, double> lattice_for(const std::vector<Vec3>& beads, const std::vector<double>& sigma) {
  MBTFM_ASSERT(sigma.size() == beads.size());
  constexpr std::size_t kFewest = 30;
  if (beads.size() < kFewest) {
    throw InvalidData("beads in the gel", "at least " + std::to_string(kFewest), std::to_string(beads.size()));
  }
  std::vector<double> z_um;
  for (std::size_t i = 0; i < beads.size(); ++i) {
    if (!is_finite(beads[i]) || !std::isfinite(sigma[i]) || sigma[i] <= 0) {
      throw InvalidData("bead " + std::to_string(i), "finite numbers, and a standard error above 0", "others");
    }
    z_um.push_back(beads[i].z);
  }
  const Extent extent = mbtfm::extent_of(beads);
  const Vec2 size = extent.high_um - extent.low_um;
  const double depth = numerics::quantile(z_um, 0.99) - numerics::quantile(z_um, 0.01);  // few may lie far off
  if (!(std::min({size.x, size.y, depth}) > 0)) {
    throw InvalidData("beads in the gel", "beads all over a volume", "all in one plane or line");
  }
  const double density = static_cast<double>(beads.size()) / (size.x * size.y * depth);
  // no further than the beads: where none can be, nothing holds the surface
  return {rectangles_over(extent, 1.1 / std::cbrt(density)), density};
}

/// Where no bead holds the surface it would sink without end. @throws InvalidData by place, where a rectangle and all
/// its neighbours have none: of some ten beads in each that is no chance
void check_filled(const Lattice& l, const std::vector<Vec3>& beads) {
  std::vector<char> is_near(static_cast<std::size_t>(l.n_x) * l.n_y, 0);
  for (const Vec3& bead : beads) {
    const auto [i, j] = square_of(l, {bead.x, bead.y});
    for (int b = std::max(0, j - 1); b <= std::min(l.n_y - 1, j + 1); ++b) {
      for (int a = std::max(0, i - 1); a <= std::min(l.n_x - 1, i + 1); ++a) is_near[a + l.n_x * b] = 1;
    }
  }
  const auto empty = std::ranges::find(is_near, 0);
  if (empty == is_near.end()) return;
  const int at = static_cast<int>(empty - is_near.begin());
  const Vec2 middle = at_place(l, {at % l.n_x + 0.5, at / l.n_x + 0.5});
  throw InvalidData(
      "beads in the gel",
      "beads all over the rectangle that they span: cut it to where they are, and leave out those that lie far off",
      "none near x, y = " + brief(middle.x) + ", " + brief(middle.y) + " um");
}

/// @throws InvalidData where the beads lie in sheets: down to `most_um`, a gap wider than `gap_um`
void check_even(std::vector<double> depths_um, double most_um, double gap_um) {
  std::ranges::sort(depths_um);
  double before = 0;
  for (const double depth : depths_um) {
    if (before > most_um) return;
    if (depth - before > gap_um) {
      throw InvalidData(
          "beads in the gel", "beads at every depth",
          "sheets of them: none between " + brief(before) + " and " + brief(depth) + " um below their surface");
    }
    before = std::max(before, depth);
  }
}

/// Across the direction in which the surface is steepest, in the mean square.
double crest_rad(const SurfaceFit& fit) {
  constexpr int kLines = 30;
  const Lattice& l = fit.lattice;
  const double step = 0.1 * std::min(l.side_um.x, l.side_um.y);
  double xx = 0, xy = 0, yy = 0;
  for (int j = 1; j < kLines; ++j) {
    for (int i = 1; i < kLines; ++i) {
      const Vec2 at = at_place(l, {1.0 * i / kLines * l.n_x, 1.0 * j / kLines * l.n_y});
      const double along = fit.height_um(at + Vec2{step, 0}) - fit.height_um(at - Vec2{step, 0});
      const double across = fit.height_um(at + Vec2{0, step}) - fit.height_um(at - Vec2{0, step});
      xx += along * along;
      xy += along * across;
      yy += across * across;
    }
  }
  return 0.5 * std::atan2(2 * xy, xx - yy) + 0.5 * std::numbers::pi;
}

/// Of one bead: expectation of -log(Phi + stray) over the surface's own error, and its derivatives by the surface.
struct Pull {
  double value = 0, slope = 0, curvature = 0;
};
constexpr double kStray = 1e-3;  ///< density of beads above the surface, over that below

/// -log(Phi + stray), 0 far below the surface.
double cost_of(double depth_um, double sigma_um) {
  return -std::log((0.5 * std::erfc(-depth_um / (sigma_um * std::numbers::sqrt2)) + kStray) / (1 + kStray));
}

/// Of a surface without an error.
Pull at_surface(double depth_um, double sigma_um) {
  const double t = depth_um / sigma_um;
  const double below = 0.5 * std::erfc(-t / std::numbers::sqrt2) + kStray;
  const double m = std::exp(-0.5 * t * t) / std::sqrt(2 * std::numbers::pi) / below;
  return {cost_of(depth_um, sigma_um), m / sigma_um, m * (m + t) / (sigma_um * sigma_um)};
}

/// Even steps of a normal distribution, up to 4.5 standard deviations, and the share of each.
struct NormalRule {
  NormalRule() {
    double total = 0;
    for (std::size_t k = 0; k < at.size(); ++k) {
      at[k] = 4.5 * (static_cast<double>(k) / 16 - 1);
      total += share[k] = std::exp(-0.5 * at[k] * at[k]);
    }
    for (double& s : share) s /= total;
  }
  std::array<double, 33> at{}, share{};
};

/// The derivatives of an expectation over a Gauss distribution are moments of the value itself (Stein): smooth, however
/// sharp the surface.
Pull pull_of(double depth_um, double sigma_um, double variance_um2) {
  static const NormalRule normal;
  const double spread = std::sqrt(variance_um2);
  Pull sum;
  if (spread < 0.1 * sigma_um) {
    sum = at_surface(depth_um, sigma_um);
  } else {
    for (std::size_t k = 0; k < normal.at.size(); ++k) {
      const double x = normal.at[k], depth = depth_um - spread * x;
      if (depth > 9 * sigma_um) continue;
      const double value = normal.share[k] * cost_of(depth, sigma_um);
      sum.value += value;
      sum.slope += x * value / spread;
      sum.curvature += (x * x - 1) * value / variance_um2;
    }
  }
  sum.curvature = std::max(0.0, sum.curvature);
  return sum;
}

class Fitter {
 public:
  Fitter(const std::vector<Vec3>& beads, const std::vector<double>& sigma, const Lattice& lattice, double density)
      : beads_(beads), sigma_(sigma), l_(lattice), density_(density), area_(VectorXd::Zero(lattice.n_splines())) {
    std::vector<double> z_um;
    for (const Vec3& bead : beads) {
      weights_.push_back(weights_at(l_, {bead.x, bead.y}));
      z_um.push_back(bead.z);
    }
    constexpr std::array kOverSquare = {1. / 24, 11. / 24, 11. / 24, 1. / 24};
    for (int j = 0; j < l_.n_y; ++j) {
      for (int i = 0; i < l_.n_x; ++i) {
        for (int k = 0; k < kLocal; ++k) {
          area_[index_of(l_, i + (l_.n_x + 3) * j, k)] +=
              l_.side_um.x * l_.side_um.y * kOverSquare[k % 4] * kOverSquare[k / 4];
        }
      }
    }
    at_.coefficients_um = VectorXd::Constant(l_.n_splines(), numerics::quantile(z_um, 0.01));
    at_.variance_um2.assign(beads.size(), 0);
  }

  /// From the last one.
  void fit(Smoothing& smoothing) {
    const Band rough = roughness(l_, smoothing.crest_rad, smoothing.ratio);
    if (!is_begun_) {
      const double apart = 1 / std::cbrt(density_);
      for (double widest = 1.5 * apart; widest > 0.05 * apart; widest /= 2)
        newton(rough, smoothing.stiffness, widest, 4);
      is_begun_ = true;
    }
    double last = 0;
    for (int round = 0; round < 40; ++round) {
      newton(rough, smoothing.stiffness, 0, 2);
      update_variances();
      const double before = smoothing.stiffness;
      // MacKay's rule: how many coefficients the data hold, over how much they are bent
      const double held = std::max(0.5, at_.held - 3), bent = at_.coefficients_um.dot(rough.times(at_.coefficients_um));
      smoothing.stiffness = std::clamp(held / std::max(bent, 1e-12), before / 10, before * 10);
      smoothing.stiffness = std::clamp(smoothing.stiffness, 1e-3, 1e6);
      const double reached = objective(with_gamma(rough, smoothing.stiffness), 0);
      if (std::abs(reached - last) < 1 && std::abs(std::log(smoothing.stiffness / before)) < 0.05) break;
      last = reached;
    }
    Band prior = with_gamma(rough, smoothing.stiffness);
    log_evidence_ = -objective(prior, 0) + 0.5 * at_.held;
    factorise(prior);
    for (int k = 0; k < prior.n; ++k) log_evidence_ += std::log(prior.at(k, k) / at_.factor->at(k, k));
  }

  double log_evidence() const { return log_evidence_; }
  void set_density(double per_um3) { density_ = per_um3; }

  /// What a fit leaves, to go on from.
  struct State {
    VectorXd coefficients_um;
    std::vector<double> variance_um2;
    std::optional<Band> factor;
    double held = 0;
  };
  const State& state() const { return at_; }
  void go_on_from(const State& state) { at_ = state; }

  /// Beads below the surface, by volume, down to half the depth of nearly all of them: where they end does not matter.
  /// @throws InvalidData where they lie in sheets
  double density_per_um3() const {
    std::vector<double> depths;
    for (std::size_t i = 0; i < beads_.size(); ++i) depths.push_back(depth_of(i));
    const double depth = 0.5 * numerics::quantile(depths, 0.98);
    const auto n = static_cast<double>(std::ranges::count_if(depths, [&](double d) { return d < depth; }));
    const double density = n / (area_.sum() * depth);
    // thicker than beads lie apart, and where twenty should be
    check_even(std::move(depths), depth, std::max(1 / std::cbrt(density), 20 * depth / n));
    return density;
  }
  std::vector<int> above() const {
    std::vector<int> found;
    for (std::size_t i = 0; i < beads_.size(); ++i) {
      if (depth_of(i) < -4 * std::sqrt(sigma_[i] * sigma_[i] + at_.variance_um2[i]))
        found.push_back(static_cast<int>(i));
    }
    return found;
  }

 private:
  /// With a hold on planes, which the plate leaves free: at a thousand times the distance of beads.
  Band with_gamma(Band rough, double gamma) const {
    for (double& v : rough.values) v *= gamma;
    for (int k = 0; k < rough.n; ++k) rough.at(k, k) += 1e-6 * std::pow(density_, 2. / 3);
    return rough;
  }
  double depth_of(std::size_t i) const { return beads_[i].z - value_of(l_, weights_[i], at_.coefficients_um); }
  bool matters(std::size_t i, double depth, double sigma) const {
    return depth < 9 * sigma + 4.5 * std::sqrt(at_.variance_um2[i]);
  }
  double sigma_of(std::size_t i, double widest) const { return std::max(sigma_[i], widest); }

  /// What the beads have no part in.
  double bending(const Band& prior) const {
    const VectorXd& c = at_.coefficients_um;
    return -density_ * area_.dot(c) + 0.5 * c.dot(prior.times(c));
  }
  double objective(const Band& prior, double widest) const {
    double sum = bending(prior);
    for (std::size_t i = 0; i < beads_.size(); ++i) {
      const double depth = depth_of(i), sigma = sigma_of(i, widest);
      if (matters(i, depth, sigma)) sum += pull_of(depth, sigma, at_.variance_um2[i]).value;
    }
    return sum;
  }

  /// Steps of Newton's method, until they gain nothing. @throws NotSolved where numbers are out of all range
  void newton(const Band& rough, double gamma, double widest, int most) {
    const Band prior = with_gamma(rough, gamma);
    for (int step = 0; step < most; ++step) {
      Band hessian = prior;
      VectorXd gradient = prior.times(at_.coefficients_um) - density_ * area_;
      double now = bending(prior);
      for (std::size_t i = 0; i < beads_.size(); ++i) {
        const double depth = depth_of(i), sigma = sigma_of(i, widest);
        if (!matters(i, depth, sigma)) continue;
        const Pull pull = pull_of(depth, sigma, at_.variance_um2[i]);
        now += pull.value;
        const Weights& w = weights_[i];
        for (int p = 0; p < kLocal; ++p) {
          const int row = index_of(l_, w.square, p);
          gradient[row] += pull.slope * w.of[p];
          for (int q = 0; q <= p; ++q) hessian.at(row, index_of(l_, w.square, q)) += pull.curvature * w.of[p] * w.of[q];
        }
      }
      if (!factorise(hessian)) throw NotSolved(Report{.reason = "no smooth surface fits the beads"});
      const VectorXd change = -solve(hessian, gradient);
      at_.factor = std::move(hessian);
      const double gain = -gradient.dot(change);
      const VectorXd from = at_.coefficients_um;
      // no further than beads lie apart: far below them all it would find fewer and fewer to hold it
      double share = std::min(1.0, 1 / (std::cbrt(density_) * change.lpNorm<Eigen::Infinity>()));
      for (; share > 1e-4; share /= 2) {
        at_.coefficients_um = from + share * change;
        if (objective(prior, widest) <= now - 0.1 * share * gain) break;
      }
      if (gain < 1e-2) return;
    }
  }

  void update_variances() {
    const Band inverse = inverse_within(*at_.factor);
    const double far = std::pow(0.4, 2) / std::pow(density_, 2. / 3);  // as uncertain as a surface may still become
    at_.held = 0;
    for (std::size_t i = 0; i < beads_.size(); ++i) {
      const double depth = depth_of(i), sigma = sigma_[i];
      if (depth > 9 * sigma + 4.5 * std::sqrt(std::max(at_.variance_um2[i], far))) continue;
      const double v = variance_of(l_, weights_[i], inverse);
      at_.variance_um2[i] = at_.variance_um2[i] == 0 ? v : std::sqrt(v * at_.variance_um2[i]);
      if (matters(i, depth, sigma)) at_.held += pull_of(depth, sigma, at_.variance_um2[i]).curvature * v;
    }
  }

  const std::vector<Vec3>& beads_;
  const std::vector<double>& sigma_;
  Lattice l_;
  double density_;
  VectorXd area_;  ///< of each spline
  State at_;
  std::vector<Weights> weights_;
  double log_evidence_ = 0;
  bool is_begun_ = false;
};

}  // namespace

double SurfaceFit::height_um(Vec2 at) const { return value_of(lattice, weights_at(lattice, at), coefficients_um); }

double SurfaceFit::sigma_um(Vec2 at) const {
  return std::sqrt(variance_of(lattice, weights_at(lattice, at), *covariance_um2));
}

SurfaceFit fit_beads(const std::vector<Vec3>& beads_um, const std::vector<double>& sigma_z_um) {
  const auto [lattice, first_density] = lattice_for(beads_um, sigma_z_um);
  check_filled(lattice, beads_um);
  Fitter fitter(beads_um, sigma_z_um, lattice, first_density);
  SurfaceFit best;
  best.lattice = lattice;
  best.log_evidence = -std::numeric_limits<double>::infinity();
  std::optional<Fitter::State> kept;
  const auto is_better = [&](Smoothing s) {
    if (kept) fitter.go_on_from(*kept);
    fitter.fit(s);
    if (fitter.log_evidence() <= best.log_evidence) return false;
    best.smoothing = s;
    best.log_evidence = fitter.log_evidence();
    kept = fitter.state();
    best.coefficients_um = kept->coefficients_um;
    return true;
  };
  is_better({});
  // the density enters the evidence: the same for all that are compared
  best.density_per_um3 = fitter.density_per_um3();
  fitter.set_density(best.density_per_um3);
  best.log_evidence = -std::numeric_limits<double>::infinity();
  is_better(best.smoothing);
  const double stiffness = best.smoothing.stiffness;
  for (const double direction : {0.0, 0.5 * std::numbers::pi, crest_rad(best)}) {
    for (double ratio = 3; ratio < 100; ratio *= 3) {
      if (!is_better({direction, ratio, stiffness})) break;
    }
  }
  fitter.go_on_from(*kept);
  best.above_surface = fitter.above();
  best.covariance_um2 = std::make_shared<const Band>(inverse_within(*kept->factor));
  return best;
}

}  // namespace mbtfm::surface
