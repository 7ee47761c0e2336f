#include "segment/cells/blurred_ellipse.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mbtfm::cells {
namespace {

/// Density and integral of the standard normal distribution, tabulated: linear interpolation in steps of 1/128 is right
/// to 1/128² / 8 · max |φ''| = 3e-6, and beyond five deviations lie 3e-7.
class NormalTable {
 public:
  struct Values {
    double density, integral;
  };
  NormalTable() {
    for (int i = 0; i <= 2 * kReach * kSteps + 1; ++i) {
      const double z = 1.0 * i / kSteps - kReach;
      table_[i] = {std::exp(-z * z / 2) / std::sqrt(2 * std::numbers::pi), std::erfc(-z / std::numbers::sqrt2) / 2};
    }
  }
  Values at(double z) const {
    const double place = (std::clamp(z, -1.0 * kReach, 1.0 * kReach) + kReach) * kSteps;
    const int i = static_cast<int>(place);
    const double u = place - i;
    const Values &a = table_[i], &b = table_[i + 1];
    return {a.density + u * (b.density - a.density), a.integral + u * (b.integral - a.integral)};
  }

 private:
  static constexpr int kReach = 5, kSteps = 128;
  std::array<Values, 2 * kReach * kSteps + 2> table_;
};

const NormalTable& normal() {
  static const NormalTable table;
  return table;
}

constexpr double kNodeSpacing = 1.2;  // in standard deviations: see the header
constexpr double kReach = 4;          // a strip further away than this many deviations adds less than 1e-4

}  // namespace

EllipseModel::EllipseModel(const BlurredEllipse& e)
    : ellipse_(e), cosine_(std::cos(e.angle_rad)), sine_(std::sin(e.angle_rad)) {
  const double pi = std::numbers::pi;
  const int n = std::max(6, static_cast<int>(std::ceil(pi * e.semi_major / (kNodeSpacing * e.blur))));
  for (int k = 0; k < n; ++k) {
    const double t = pi * ((k + 0.5) / n - 0.5), s = std::sin(t), c = std::cos(t);
    nodes_.push_back({s, e.semi_major * s, e.semi_minor * c, e.semi_major * c * pi / n / e.blur,
                      e.brightness * (1 - e.dome * s * s) + e.slope * s});
  }
}

// Of a strip |w| ≤ h:  P = ∫ φ(v − w) dw = Φ(z₊) − Φ(z₋),  z± = (v ± h)/σ,  and with p± = φ(z±), in units of the blur σ
//   M = ∫ w φ dw = vP + σ(p₊ − p₋),   Q = ∫ w² φ dw = (v² + σ²) P + σ((v − h) p₊ − (v + h) p₋)
//   ∂Q/∂v = 2M + h²(p₊ − p₋)/σ,  ∂Q/∂h = h²(p₊ + p₋)/σ,  ∂Q/∂ln σ = σ² ∂²Q/∂v² (the Gaussian solves the heat equation)

double EllipseModel::value(double x, double y) const {
  const double u = (x - ellipse_.x) * cosine_ + (y - ellipse_.y) * sine_;
  const double v = -(x - ellipse_.x) * sine_ + (y - ellipse_.y) * cosine_;
  const double blur = ellipse_.blur, fall = ellipse_.brightness * ellipse_.dome / std::pow(ellipse_.semi_minor, 2);
  double sum = 0;
  for (const Node& node : nodes_) {
    const double z = (u - node.along) / blur, h = node.half_width;
    if (std::abs(z) > kReach) continue;
    const auto low = normal().at((v - h) / blur), high = normal().at((v + h) / blur);
    const double P = high.integral - low.integral;
    const double Q = (v * v + blur * blur) * P + blur * ((v - h) * high.density - (v + h) * low.density);
    sum += node.weight * normal().at(z).density * (node.brightness * P - fall * Q);
  }
  return sum;
}

EllipseValue EllipseModel::with_derivatives(double x, double y) const {
  const double u = (x - ellipse_.x) * cosine_ + (y - ellipse_.y) * sine_;
  const double v = -(x - ellipse_.x) * sine_ + (y - ellipse_.y) * cosine_;
  const double blur = ellipse_.blur, b2 = ellipse_.semi_minor * ellipse_.semi_minor;
  const double fall = ellipse_.brightness * ellipse_.dome / b2;
  double value = 0, by_u = 0, by_v = 0, by_major = 0, by_minor = 0, by_slope = 0, by_blur = 0, flat = 0, curved = 0;
  for (const Node& node : nodes_) {
    const double z = (u - node.along) / blur, h = node.half_width;
    if (std::abs(z) > kReach) continue;
    const double z_low = (v - h) / blur, z_high = (v + h) / blur;
    const auto low = normal().at(z_low), high = normal().at(z_high);
    const double P = high.integral - low.integral, sum = high.density + low.density, gap = high.density - low.density;
    const double ends = z_high * high.density - z_low * low.density;
    const double Q = (v * v + blur * blur) * P + blur * ((v - h) * high.density - (v + h) * low.density);
    const double M = v * P + blur * gap;
    const double along = node.weight * normal().at(z).density;
    const double strip = node.brightness * P - fall * Q;
    flat += along * P;
    curved += along * (node.sine * node.sine * P + Q / b2);
    by_slope += along * node.sine * P;
    value += along * strip;
    by_u -= along * strip * z / blur;
    by_v += along * (node.brightness * gap / blur - fall * (2 * M + h * h * gap / blur));
    by_major += along * strip * (1 + node.along * z / blur);
    by_minor += along * (node.brightness * sum * h / blur - fall * (h * h * h * sum / blur - 2 * Q));
    const double Q_by_blur = 2 * blur * blur * P - 2 * blur * h * sum - h * h * ends;
    by_blur += along * (strip * (z * z - 1) - node.brightness * ends - fall * Q_by_blur);
  }
  return {value,
          {-by_u * cosine_ + by_v * sine_, -by_u * sine_ - by_v * cosine_, by_major, by_minor, by_u * v - by_v * u,
           flat - ellipse_.dome * curved, by_slope, -ellipse_.brightness * curved, by_blur}};
}

}  // namespace mbtfm::cells
