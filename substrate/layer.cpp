#include "substrate/layer.h"

#include <math.h>  // j0, j1: POSIX, several times faster than std::cyl_bessel_j

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mbtfm::substrate {

using std::numbers::pi;

namespace {

constexpr int kPieces = static_cast<int>(LayerTable::kReach);
constexpr int kOrder = LayerTable::kOrder;  // the nearest singularity, r = 2i, is 4 half pieces away: 8^-16 = 4e-15
constexpr double kAverageTolerance = 1e-9;

/// Nodes and weights of the transforms' integral over x = k h, the integrands' factors included.
struct Transform {
  std::vector<double> x, s_weight, d_weight;
};

Transform transform(double nu) {
  // the factors fall as x² exp(-2x): below 1e-17 at x = 24. Panels of 1/2 with 20 Gauss points resolve J(40 x), which
  // turns 3 times in each, to rounding.
  constexpr int kPanels = 48;
  constexpr double kPanel = 0.5;
  const GaussRule gauss = gauss_legendre(20);
  const double kappa = 3 - 4 * nu;
  Transform result;
  for (int panel = 0; panel < kPanels; ++panel) {
    for (std::size_t g = 0; g < gauss.nodes.size(); ++g) {
      const double x = kPanel * (panel + 0.5 * (1 + gauss.nodes[g]));
      const double weight = 0.5 * kPanel * gauss.weights[g];
      const double decay = std::exp(-2 * x);
      const double square = 1 + kappa * kappa + 4 * x * x;
      // L - 1 and tanh - 1, both over exp(-2x) to spare the cancellation
      const double l = decay * (4 * x - 2 * kappa * decay - square) / (kappa * (1 + decay * decay) + square * decay);
      const double t = -2 * decay / (1 + decay);
      result.x.push_back(x);
      result.s_weight.push_back(0.5 * weight * ((1 - nu) * l + t));
      result.d_weight.push_back(-0.5 * weight * ((1 - nu) * l - t));
    }
  }
  return result;
}

LayerTable::Value integrate(const Transform& transform, double r) {
  LayerTable::Value value;
  for (std::size_t i = 0; i < transform.x.size(); ++i) {
    const double xr = transform.x[i] * r;
    const double bessel_0 = ::j0(xr);
    // J2 = 2 J1(x)/x - J0 cancels at small x, where its series does not
    const double bessel_2 = xr < 1e-2 ? xr * xr / 8 * (1 - xr * xr / 12) : 2 * ::j1(xr) / xr - bessel_0;
    value.s += transform.s_weight[i] * bessel_0;
    value.d += transform.d_weight[i] * bessel_2;
  }
  return value;
}

/// S I + D (2 e e^T - I)
Sym2 tensor(LayerTable::Value value, Vec2 offset, double squared) {
  const double twice = squared > 0 ? 2 * value.d / squared : 0;
  const double even = value.s - (squared > 0 ? value.d : 0);
  return {even + twice * offset.x * offset.x, twice * offset.x * offset.y, even + twice * offset.y * offset.y};
}

}  // namespace

LayerTable::LayerTable(double poisson_ratio) : poisson_ratio_(poisson_ratio), coefficients_(2 * kPieces * kOrder) {
  const Transform factors = transform(poisson_ratio);
  for (int piece = 0; piece < kPieces; ++piece) {
    double* s = &coefficients_[2 * piece * kOrder];
    double* d = s + kOrder;
    for (int node = 0; node < kOrder; ++node) {
      const double angle = pi * (node + 0.5) / kOrder;
      const Value value = integrate(factors, piece + 0.5 * (1 + std::cos(angle)));
      for (int k = 0; k < kOrder; ++k) {
        const double weight = (k == 0 ? 1.0 : 2.0) / kOrder * std::cos(k * angle);
        s[k] += weight * value.s;
        d[k] += weight * value.d;
      }
    }
  }
}

LayerTable::Value LayerTable::correction(double r) const {
  // beyond the reach: what cancels the half-space's
  if (r >= kReach) return {-(2 - poisson_ratio_) / (2 * r), -poisson_ratio_ / (2 * r)};
  const int piece = static_cast<int>(r);
  const double* s = &coefficients_[2 * piece * kOrder];
  const double* d = s + kOrder;
  const double twice = 4 * (r - piece) - 2;
  double s_next = 0, s_after = 0, d_next = 0, d_after = 0;
  for (int k = kOrder - 1; k > 0; --k) {  // Clenshaw
    const double s_now = twice * s_next - s_after + s[k];
    const double d_now = twice * d_next - d_after + d[k];
    s_after = s_next;
    d_after = d_next;
    s_next = s_now;
    d_next = d_now;
  }
  return {0.5 * twice * s_next - s_after + s[0], 0.5 * twice * d_next - d_after + d[0]};
}

Layer::Layer(const Gel& gel)
    : gel_((mbtfm::check(gel), gel)),
      table_(gel.poisson_ratio),
      scale_(1 / (2 * pi * shear_modulus_kPa(gel) * gel.thickness_um)) {}

Sym2 Layer::point_correction_um_per_nN(Vec2 offset_um) const {
  const double squared = dot(offset_um, offset_um);
  const double r = std::sqrt(squared) / gel_.thickness_um;
  return scale_ * tensor(table_.correction(r), offset_um, squared);
}

Sym2 Layer::point_compliance_um_per_nN(Vec2 offset_um) const {
  const double squared = dot(offset_um, offset_um);
  const double r = std::sqrt(squared) / gel_.thickness_um;
  if (r >= LayerTable::kReach) return {};
  LayerTable::Value value = table_.correction(r);
  value.s += (2 - gel_.poisson_ratio) / (2 * r);
  value.d += gel_.poisson_ratio / (2 * r);
  return scale_ * tensor(value, offset_um, squared);
}

LayerEllipse::LayerEllipse(const Layer& layer, const Ellipse& ellipse) : layer_(layer), ellipse_(ellipse) {
  // A function whose nearest singularity lies at z semi-axes beside the ellipse is averaged by a rule of degree n to
  // about q^(n+1), q = 1/(z + sqrt(z² + 1)); the correction has its own at z = 2 h / a, up or down.
  const double z = 2 * layer.gel().thickness_um / ellipse.semi_major_um;
  const double q = 1 / (z + std::sqrt(z * z + 1));
  const int degree = static_cast<int>(std::ceil(std::log(kAverageTolerance) / std::log(q))) - 1;
  correction_rule_ = ellipse_rule(ellipse, std::max(3, degree));
  // Far away the whole field is averaged: cheaper than the chords, and the two halves of a small difference cannot
  // part. A rule of degree n errs by (a/r)^(n+1) in powers of r and by (0.74 a/h)^(n+1) / (n+1)! in the layer's
  // exp(-0.74 r/h), below the tolerance where r = a / tolerance^(1/(n+1)) is at most 6 h.
  for (const int far_degree : {3, 5}) {
    const double ratio = std::pow(kAverageTolerance, -1.0 / (far_degree + 1));
    if (ellipse.semi_major_um * ratio > 6 * layer.gel().thickness_um) continue;
    far_rules_.push_back({ratio * ellipse.semi_major_um, ellipse_rule(ellipse, far_degree)});
  }
  std::sort(far_rules_.begin(), far_rules_.end(),
            [](const FarRule& one, const FarRule& other) { return one.from_um > other.from_um; });
}

Sym2 LayerEllipse::compliance_um_per_nN(Vec2 point_um) const {
  const Vec2 offset = point_um - ellipse_.centre_um;
  const double distance = norm(offset);
  if (distance > LayerTable::kReach * layer_.gel().thickness_um + ellipse_.semi_major_um) return {};
  Sym2 sum;
  for (const FarRule& rule : far_rules_) {
    if (distance < rule.from_um) continue;
    for (const DiscPoint& p : rule.points) sum += p.weight * layer_.point_compliance_um_per_nN(offset - p.position);
    return sum;
  }
  sum = half_space_compliance_um_per_nN(layer_.gel(), ellipse_, point_um);
  for (const DiscPoint& p : correction_rule_) {
    sum += p.weight * layer_.point_correction_um_per_nN(offset - p.position);
  }
  return sum;
}

}  // namespace mbtfm::substrate
