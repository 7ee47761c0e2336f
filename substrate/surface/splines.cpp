#include "substrate/surface/splines.h"

#include <algorithm>
#include <cmath>

#include "pipeline/numerics/quadrature.h"

namespace mbtfm::surface {
namespace {

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

}  // namespace

Lattice rectangles_over(const Extent& extent, double side_um) {
  const Vec2 size = extent.high_um - extent.low_um;
  const double side = std::max(side_um, std::max(size.x, size.y) / 150);
  const auto n = [&](double length) { return std::max(1, static_cast<int>(std::ceil(length / side))); };
  const int n_x = n(size.x), n_y = n(size.y);
  return {extent.low_um, {size.x / n_x, size.y / n_y}, n_x, n_y};
}

std::array<int, 2> square_of(const Lattice& l, Vec2 at) {
  const Vec2 place = place_in(l, at);
  return {std::clamp(static_cast<int>(std::floor(place.x)), 0, l.n_x - 1),
          std::clamp(static_cast<int>(std::floor(place.y)), 0, l.n_y - 1)};
}

Weights weights_at(const Lattice& l, Vec2 at) {
  const auto [i, j] = square_of(l, at);
  const Vec2 place = place_in(l, at);
  const Spline along(place.x - i), across(place.y - j);
  Weights w{.square = i + (l.n_x + 3) * j};
  for (int k = 0; k < kLocal; ++k) w.of[k] = along.value[k % 4] * across.value[k / 4];
  return w;
}
SlopeWeights slope_weights_at(const Lattice& l, Vec2 at) {
  const auto [i, j] = square_of(l, at);
  const Vec2 place = place_in(l, at);
  const Spline along(place.x - i), across(place.y - j);
  const int square = i + (l.n_x + 3) * j;
  SlopeWeights w{{.square = square}, {.square = square}};
  for (int k = 0; k < kLocal; ++k) {
    w.x.of[k] = along.slope[k % 4] * across.value[k / 4] / l.side_um.x;
    w.y.of[k] = along.value[k % 4] * across.slope[k / 4] / l.side_um.y;
  }
  return w;
}

double value_of(const Lattice& l, const Weights& w, const Eigen::VectorXd& coefficients) {
  double sum = 0;
  for (int k = 0; k < kLocal; ++k) sum += w.of[k] * coefficients[index_of(l, w.square, k)];
  return sum;
}

Band roughness(const Lattice& l, double crest_rad, double ratio) {
  const double c = std::cos(crest_rad), s = std::sin(crest_rad);
  const Vec2 sides = l.side_um;
  const numerics::GaussRule gauss = numerics::gauss_legendre(3);
  Eigen::Matrix<double, kLocal, kLocal> square = Eigen::Matrix<double, kLocal, kLocal>::Zero();
  for (int b = 0; b < 3; ++b) {
    for (int a = 0; a < 3; ++a) {
      const Spline x(0.5 + 0.5 * gauss.nodes[a]), y(0.5 + 0.5 * gauss.nodes[b]);
      Eigen::Matrix<double, kLocal, 1> xx, xy, yy;
      for (int k = 0; k < kLocal; ++k) {
        xx[k] = x.curvature[k % 4] * y.value[k / 4] / (sides.x * sides.x);
        xy[k] = x.slope[k % 4] * y.slope[k / 4] / (sides.x * sides.y);
        yy[k] = x.value[k % 4] * y.curvature[k / 4] / (sides.y * sides.y);
      }
      const Eigen::Matrix<double, kLocal, 1> uu = c * c * xx + 2 * c * s * xy + s * s * yy,
                                             vv = s * s * xx - 2 * c * s * xy + c * c * yy,
                                             uv = c * s * (yy - xx) + (c * c - s * s) * xy;
      square += 0.25 * gauss.weights[a] * gauss.weights[b] * sides.x * sides.y *
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

}  // namespace mbtfm::surface
