#include "substrate/surface/beads.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>
#include <optional>
#include <string>

#include "pipeline/contract/errors.h"

namespace mbtfm::surface {
namespace {

using Eigen::VectorXd;

constexpr int kLocal = 16;  ///< splines over a square

struct Weights {
  int square = 0;  ///< first coefficient
  std::array<double, kLocal> of{};
};

/// Cubic B-splines over one interval, at t in [0, 1]; their slopes and curvatures by interval.
struct Spline {
  explicit Spline(double t) {
    const double u = 1 - t;
    value = {u * u * u / 6, (3 * t * t * t - 6 * t * t + 4) / 6, (3 * u * u * u - 6 * u * u + 4) / 6, t * t * t / 6};
    slope = {-u * u / 2, (3 * t * t - 4 * t) / 2, (4 * u - 3 * u * u) / 2, t * t / 2};
    curvature = {u, 3 * t - 2, 3 * u - 2, t};
  }
  std::array<double, 4> value, slope, curvature;
};

Weights weights_at(const Lattice& l, Vec2 at) {
  const double a = (at.x - l.corner_um.x) / l.side_um, b = (at.y - l.corner_um.y) / l.side_um;
  const int i = std::clamp(static_cast<int>(std::floor(a)), 0, l.n_x - 1);
  const int j = std::clamp(static_cast<int>(std::floor(b)), 0, l.n_y - 1);
  const Spline along(a - i), across(b - j);
  Weights w{.square = i + (l.n_x + 3) * j};
  for (int k = 0; k < kLocal; ++k) w.of[k] = along.value[k % 4] * across.value[k / 4];
  return w;
}
int index_of(const Lattice& l, int square, int k) { return square + k % 4 + (l.n_x + 3) * (k / 4); }

Band roughness(const Lattice& l, double crest_rad, double ratio) {
  const double c = std::cos(crest_rad), s = std::sin(crest_rad);
  constexpr std::array kGauss = {0.1127016653792583, 0.5, 0.8872983346207417};
  constexpr std::array kShare = {5. / 18, 8. / 18, 5. / 18};
  Eigen::Matrix<double, kLocal, kLocal> square = Eigen::Matrix<double, kLocal, kLocal>::Zero();
  for (int b = 0; b < 3; ++b) {
    for (int a = 0; a < 3; ++a) {
      const Spline x(kGauss[a]), y(kGauss[b]);
      Eigen::Matrix<double, kLocal, 1> xx, xy, yy;
      for (int k = 0; k < kLocal; ++k) {
        xx[k] = x.curvature[k % 4] * y.value[k / 4];
        xy[k] = x.slope[k % 4] * y.slope[k / 4];
        yy[k] = x.value[k % 4] * y.curvature[k / 4];
      }
      const Eigen::Matrix<double, kLocal, 1> uu = c * c * xx + 2 * c * s * xy + s * s * yy,
                                             vv = s * s * xx - 2 * c * s * xy + c * c * yy,
                                             uv = c * s * (yy - xx) + (c * c - s * s) * xy;
      square += kShare[a] * kShare[b] / (l.side_um * l.side_um) *
                (ratio * ratio * uu * uu.transpose() + 2 * ratio * uv * uv.transpose() + vv * vv.transpose());
    }
  }
  Band r(l.n_splines(), 3 * (l.n_x + 3) + 3);
  for (int j = 0; j < l.n_y; ++j) {
    for (int i = 0; i < l.n_x; ++i) {
      const int at = i + (l.n_x + 3) * j;
      for (int p = 0; p < kLocal; ++p) {
        for (int q = 0; q < kLocal; ++q) {
          const int row = index_of(l, at, p), column = index_of(l, at, q);
          if (row >= column) r.at(row, column) += square(p, q);
        }
      }
    }
  }
  return r;
}

double variance_of(const Lattice& l, const Weights& w, const Band& covariance) {
  double sum = 0;
  for (int p = 0; p < kLocal; ++p) {
    for (int q = 0; q < kLocal; ++q) {
      sum += w.of[p] * w.of[q] * covariance.symmetric(index_of(l, w.square, p), index_of(l, w.square, q));
    }
  }
  return sum;
}

/// Squares about as wide as beads lie apart, over all of them; and the density that says so.
std::pair<Lattice, double> lattice_for(const std::vector<Vec3>& beads, const std::vector<double>& sigma) {
  constexpr std::size_t kFewest = 30;
  if (beads.size() < kFewest || sigma.size() != beads.size()) {
    throw InvalidData("beads in the gel", "at least " + std::to_string(kFewest) + ", each with a standard error",
                      std::to_string(beads.size()));
  }
  Vec3 low = beads.front(), high = low;
  for (std::size_t i = 0; i < beads.size(); ++i) {
    if (!is_finite(beads[i]) || !std::isfinite(sigma[i]) || sigma[i] <= 0) {
      throw InvalidData("bead " + std::to_string(i), "finite numbers, and a standard error above 0", "others");
    }
    low = {std::min(low.x, beads[i].x), std::min(low.y, beads[i].y), std::min(low.z, beads[i].z)};
    high = {std::max(high.x, beads[i].x), std::max(high.y, beads[i].y), std::max(high.z, beads[i].z)};
  }
  const double width = high.x - low.x, height = high.y - low.y, depth = high.z - low.z;
  if (!(std::min({width, height, depth}) > 0)) {
    throw InvalidData("beads in the gel", "beads all over a volume", "all in one plane or line");
  }
  const double density = static_cast<double>(beads.size()) / (width * height * depth);
  const double side = std::max(1.1 / std::cbrt(density), std::max(width, height) / 150);
  const auto n = [&](double length) { return std::max(1, static_cast<int>(std::ceil(length / side))); };
  return {{{low.x, low.y}, side, n(width), n(height)}, density};
}

/// Across the direction in which the surface is steepest, in the mean square.
double crest_rad(const SurfaceFit& fit) {
  constexpr int kLines = 30;
  const Lattice& l = fit.lattice;
  const double step = 0.1 * l.side_um;
  double xx = 0, xy = 0, yy = 0;
  for (int j = 1; j < kLines; ++j) {
    for (int i = 1; i < kLines; ++i) {
      const Vec2 at = l.corner_um + l.side_um / kLines * Vec2{1.0 * i * l.n_x, 1.0 * j * l.n_y};
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

Pull at_surface(double depth_um, double sigma_um) {
  const double t = depth_um / sigma_um;
  const double below = 0.5 * std::erfc(-t / std::numbers::sqrt2) + kStray;
  const double m = std::exp(-0.5 * t * t) / std::sqrt(2 * std::numbers::pi) / below;
  return {-std::log(below / (1 + kStray)), m / sigma_um, m * (m + t) / (sigma_um * sigma_um)};
}

/// The derivatives of an expectation over a Gauss distribution are moments of the value itself (Stein): smooth, however
/// sharp the surface.
Pull pull_of(double depth_um, double sigma_um, double variance_um2) {
  const double spread = std::sqrt(variance_um2);
  Pull sum;
  if (spread < 0.1 * sigma_um) {
    sum = at_surface(depth_um, sigma_um);
  } else {
    constexpr int kHalf = 16;
    static const std::array<double, 2 * kHalf + 1> kShares = [] {
      std::array<double, 2 * kHalf + 1> shares{};
      double total = 0;
      for (int k = -kHalf; k <= kHalf; ++k) total += shares[k + kHalf] = std::exp(-0.5 * std::pow(4.5 * k / kHalf, 2));
      for (double& share : shares) share /= total;
      return shares;
    }();
    for (int k = -kHalf; k <= kHalf; ++k) {
      const double x = 4.5 * k / kHalf, depth = depth_um - spread * x;
      if (depth > 9 * sigma_um) continue;
      const double value =
          kShares[k + kHalf] *
          -std::log((0.5 * std::erfc(-depth / (sigma_um * std::numbers::sqrt2)) + kStray) / (1 + kStray));
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
    std::vector<double> depths;
    for (const Vec3& bead : beads) {
      weights_.push_back(weights_at(l_, {bead.x, bead.y}));
      depths.push_back(bead.z);
    }
    constexpr std::array kOverSquare = {1. / 24, 11. / 24, 11. / 24, 1. / 24};
    for (int j = 0; j < l_.n_y; ++j) {
      for (int i = 0; i < l_.n_x; ++i) {
        for (int k = 0; k < kLocal; ++k) {
          area_[index_of(l_, i + (l_.n_x + 3) * j, k)] +=
              l_.side_um * l_.side_um * kOverSquare[k % 4] * kOverSquare[k / 4];
        }
      }
    }
    const auto low = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 100);
    std::nth_element(depths.begin(), low, depths.end());
    at_.coefficients_um = VectorXd::Constant(l_.n_splines(), *low);
    at_.variance_um2.assign(beads.size(), 0);
  }

  /// From the last one.
  void fit(Smoothing& smoothing) {
    const Band rough = roughness(l_, smoothing.crest_rad, smoothing.ratio);
    if (!is_begun_) {
      for (double widest = 8; widest > 0.25; widest /= 2) newton(rough, smoothing.stiffness, widest, 4);
      is_begun_ = true;
    }
    double last = 0;
    for (int round = 0; round < 40; ++round) {
      newton(rough, smoothing.stiffness, 0, 2);
      update_variances();
      const double before = smoothing.stiffness;
      // MacKay's rule: coefficients that the data tell over what they are bent
      const double told = std::max(0.5, at_.held - 3), bent = at_.coefficients_um.dot(rough.times(at_.coefficients_um));
      smoothing.stiffness = std::clamp(told / std::max(bent, 1e-12), before / 10, before * 10);
      smoothing.stiffness = std::clamp(smoothing.stiffness, 1e-3, 1e6);
      const double reached = objective(with_gamma(rough, smoothing.stiffness), 0);
      if (std::abs(reached - last) < 1 && std::abs(std::log(smoothing.stiffness / before)) < 0.05) break;
      last = reached;
    }
    Band prior = with_gamma(rough, smoothing.stiffness);
    factorise(prior);
    double log_prior = 0, log_posterior = 0;
    for (int k = 0; k < prior.n; ++k) {
      log_prior += std::log(prior.at(k, k));
      log_posterior += std::log(at_.factor->at(k, k));
    }
    log_evidence_ = -objective(with_gamma(rough, smoothing.stiffness), 0) + 0.5 * at_.held + log_prior - log_posterior;
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
  double density_per_um3() const {
    std::vector<double> depths;
    for (std::size_t i = 0; i < beads_.size(); ++i) depths.push_back(depth_of(i));
    const auto deep = depths.begin() + static_cast<std::ptrdiff_t>(0.98 * static_cast<double>(depths.size()));
    std::nth_element(depths.begin(), deep, depths.end());
    const double depth = 0.5 * *deep;
    const auto n = std::count_if(depths.begin(), depths.end(), [&](double d) { return d < depth; });
    return static_cast<double>(n) / (area_.sum() * depth);
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
  static Band with_gamma(Band rough, double gamma) {
    for (double& v : rough.values) v *= gamma;
    for (int k = 0; k < rough.n; ++k) rough.at(k, k) += 1e-8;  // planes are free: a mm for their standard error
    return rough;
  }
  double depth_of(std::size_t i) const {
    double s = 0;
    for (int k = 0; k < kLocal; ++k) s += weights_[i].of[k] * at_.coefficients_um[index_of(l_, weights_[i].square, k)];
    return beads_[i].z - s;
  }
  bool matters(std::size_t i, double depth, double sigma) const {
    return depth < 9 * sigma + 4.5 * std::sqrt(at_.variance_um2[i]);
  }
  double sigma_of(std::size_t i, double widest) const { return std::max(sigma_[i], widest); }

  double objective(const Band& prior, double widest) const {
    double sum =
        -density_ * area_.dot(at_.coefficients_um) + 0.5 * at_.coefficients_um.dot(prior.times(at_.coefficients_um));
    for (std::size_t i = 0; i < beads_.size(); ++i) {
      const double depth = depth_of(i), sigma = sigma_of(i, widest);
      if (matters(i, depth, sigma)) sum += pull_of(depth, sigma, at_.variance_um2[i]).value;
    }
    return sum;
  }

  /// True where it still moved.
  bool newton(const Band& rough, double gamma, double widest, int most) {
    const Band prior = with_gamma(rough, gamma);
    for (int step = 0; step < most; ++step) {
      Band hessian = prior;
      VectorXd gradient = prior.times(at_.coefficients_um) - density_ * area_;
      double now =
          -density_ * area_.dot(at_.coefficients_um) + 0.5 * at_.coefficients_um.dot(prior.times(at_.coefficients_um));
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
      if (!factorise(hessian)) return false;
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
      if (gain < 1e-2) return false;
    }
    return true;
  }

  void update_variances() {
    const Band inverse = inverse_within(*at_.factor);
    at_.held = 0;
    for (std::size_t i = 0; i < beads_.size(); ++i) {
      const double depth = depth_of(i), sigma = sigma_[i];
      if (depth > 9 * sigma + 4.5 * std::sqrt(std::max(at_.variance_um2[i], 4.0))) continue;
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

double SurfaceFit::height_um(Vec2 at) const {
  const Weights w = weights_at(lattice, at);
  double s = 0;
  for (int k = 0; k < kLocal; ++k) s += w.of[k] * coefficients_um[index_of(lattice, w.square, k)];
  return s;
}

double SurfaceFit::sigma_um(Vec2 at) const {
  return std::sqrt(variance_of(lattice, weights_at(lattice, at), *covariance_um2));
}

SurfaceFit fit_beads(const std::vector<Vec3>& beads_um, const std::vector<double>& sigma_z_um) {
  const auto [lattice, first_density] = lattice_for(beads_um, sigma_z_um);
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
