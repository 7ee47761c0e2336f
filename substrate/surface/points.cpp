#include "substrate/surface/points.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/report.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::surface {
namespace {

using Eigen::VectorXd;

constexpr double kFreedom = 4;  // of Student's distribution: a stray of ten errors weighs a twentieth

Lattice lattice_over(const std::vector<Vec3>& points) {
  constexpr std::size_t kFewest = 16;
  if (points.size() < kFewest)
    throw InvalidData("points of the surface", "at least " + std::to_string(kFewest), std::to_string(points.size()));
  double xx = 0, xy = 0, yy = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vec3& p = points[i];
    if (!is_finite(p)) throw InvalidData("point " + std::to_string(i), "finite coordinates", "NaN or infinity");
    const Vec2 from = {p.x - points[0].x, p.y - points[0].y};
    xx += from.x * from.x;
    xy += from.x * from.y;
    yy += from.y * from.y;
  }
  if (!(xx * yy - xy * xy > 1e-9 * xx * yy))
    throw InvalidData("points of the surface", "points all over it", "all on one line, seen from above");
  const Extent extent = mbtfm::extent_of(points);
  return rectangles_over(extent, std::sqrt(extent.area_um2() / static_cast<double>(points.size())));
}

class PointFitter {
 public:
  PointFitter(const std::vector<Vec3>& points, const std::vector<double>& sigma)
      : points_(points), given_(sigma), l_(lattice_over(points)), rough_(roughness(l_, 0, 1)) {
    std::vector<double> z;
    for (const Vec3& p : points) {
      weights_.push_back(weights_at(l_, {p.x, p.y}));
      z.push_back(p.z);
    }
    middle_um_ = numerics::quantile(z, 0.5);
    for (double& value : z) value = std::abs(value - middle_um_);
    // of four points in five: strays that lie far off do not count from the beginning, even ground does not hide bumps
    spread_um_ = std::max(numerics::quantile(z, 0.8), 1e-3 * std::min(l_.side_um.x, l_.side_um.y));
    coefficients_ = VectorXd::Zero(l_.n_splines());
    scale_ = given_.empty() ? spread_um_ : std::max(1.0, spread_um_ / numerics::quantile(given_, 0.5));
    trust_.assign(points.size(), 1);
    // as if over the whole field the plate bent by its spread
    const double area = l_.side_um.x * l_.n_x * l_.side_um.y * l_.n_y;
    stiffness_ = area / (spread_um_ * spread_um_);
  }

  PointFit fit() {
    constexpr int kMostRounds = 200;
    for (int round = 0; round < kMostRounds; ++round) {
      const double stiffness = stiffness_, scale = scale_;
      const Band covariance = solve_once();
      update(covariance);
      constexpr double kStill = 0.01;  // of its logarithm: far below what the evidence can resolve
      if (std::abs(std::log(stiffness_ / stiffness)) < kStill && std::abs(std::log(scale_ / scale)) < kStill) break;
      if (round + 1 == kMostRounds)
        throw NotSolved(
            Report{.reason = "no smooth surface through the points: their errors and the smoothness did not settle"});
    }
    PointFit fit{.lattice = l_,
                 .coefficients_um = coefficients_.array() + middle_um_,
                 .covariance_um2 = nullptr,
                 .error_scale = scale_,
                 .strays = {}};
    fit.covariance_um2 = std::make_shared<const Band>(solve_once());
    constexpr double kFar = 5;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      if (std::abs(residual(i)) > kFar * sigma(i)) fit.strays.push_back(static_cast<int>(i));
    }
    return fit;
  }

 private:
  double sigma(std::size_t i) const { return scale_ * (given_.empty() ? 1 : given_[i]); }
  double residual(std::size_t i) const { return points_[i].z - middle_um_ - value_of(l_, weights_[i], coefficients_); }

  /// The surface under the present trust in each point. @return its covariance within the band
  Band solve_once() {
    Band h = rough_;
    for (double& v : h.values) v *= stiffness_;
    const double hold = 1e-9 / (spread_um_ * spread_um_);  // of planes, which the plate leaves free
    for (int k = 0; k < h.n; ++k) h.at(k, k) += hold;
    VectorXd right = VectorXd::Zero(h.n);
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const Weights& w = weights_[i];
      const double precision = trust_[i] / (sigma(i) * sigma(i));
      for (int p = 0; p < kLocal; ++p) {
        const int row = index_of(l_, w.square, p);
        right[row] += precision * w.of[p] * (points_[i].z - middle_um_);
        for (int q = 0; q <= p; ++q) h.at(row, index_of(l_, w.square, q)) += precision * w.of[p] * w.of[q];
      }
    }
    if (!factorise(h)) throw NotSolved(Report{.reason = "no smooth surface through the points: ill-posed"});
    coefficients_ = solve(h, right);
    return inverse_within(h);
  }

  void update(const Band& covariance) {
    double held = 0, misfit = 0;
    for (std::size_t i = 0; i < points_.size(); ++i) {
      const double v = variance_of(l_, weights_[i], covariance), r = residual(i), s = sigma(i);
      held += trust_[i] * v / (s * s);
      misfit += trust_[i] * (r * r + v) / (s * s);
      trust_[i] = (kFreedom + 1) / (kFreedom + (r * r + v) / (s * s));
    }
    scale_ *= std::sqrt(misfit / static_cast<double>(points_.size()));
    // through points without errors it would go on falling: no less than a thousandth of the spread
    scale_ = std::max(scale_, given_.empty() ? 1e-3 * spread_um_ : 1.0);
    const double bent = coefficients_.dot(rough_.times(coefficients_));
    const double known = std::max(0.5, held - 3);  // the three of a plane are not bent
    stiffness_ = std::clamp(known / std::max(bent, 1e-12 * known), stiffness_ / 10, stiffness_ * 10);
    // beyond it a plane is a plane
    const double area = l_.side_um.x * l_.n_x * l_.side_um.y * l_.n_y;
    stiffness_ = std::min(stiffness_, 1e9 * area / (spread_um_ * spread_um_));
  }

  const std::vector<Vec3>& points_;
  const std::vector<double>& given_;
  Lattice l_;
  Band rough_;
  std::vector<Weights> weights_;
  std::vector<double> trust_;
  VectorXd coefficients_;
  double middle_um_ = 0, spread_um_ = 1, scale_ = 1, stiffness_ = 1;
};

}  // namespace

double PointFit::sigma_um(Vec2 at) const {
  return std::sqrt(variance_of(lattice, weights_at(lattice, at), *covariance_um2));
}

PointFit fit_points(const std::vector<Vec3>& points_um, const std::vector<double>& sigma_um) {
  MBTFM_ASSERT(sigma_um.empty() || sigma_um.size() == points_um.size());
  for (std::size_t i = 0; i < sigma_um.size(); ++i) {
    if (!(sigma_um[i] > 0 && std::isfinite(sigma_um[i])))
      throw InvalidData("point " + std::to_string(i), "a standard error above 0", brief(sigma_um[i]));
  }
  return PointFitter(points_um, sigma_um).fit();
}

}  // namespace mbtfm::surface
