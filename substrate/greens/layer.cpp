#include "substrate/greens/layer.h"

#include <math.h>  // j0, j1: POSIX, several times faster than std::cyl_bessel_j

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/numerics/quadrature.h"
#include "substrate/greens/transforms.h"
#include "substrate/material.h"

namespace mbtfm::greens {

using std::numbers::pi;

namespace {

using Value = LayerTable::Value;
constexpr int kOrder = LayerTable::kOrder;
constexpr int kUnitOrder = 16;  // over one thickness the singularity r = 2i is 4 half lengths away: 8^-16 = 4e-15
constexpr double kAverageTolerance = 1e-8;  // of the leading term left out, whose factor is 0.1 or less

/// Nodes and weights of the transforms' integral over x = k h, the integrands' factors included.
struct Transform {
  std::vector<double> x, s_weight, d_weight;
};

Transform transform(double nu) {
  // the factors fall as x² exp(-2x): below 1e-17 at x = 24. Panels of 1/2 with 20 Gauss points resolve J(40 x), which
  // turns 3 times in each, to rounding.
  constexpr int kPanels = 48;
  constexpr double kPanel = 0.5;
  const numerics::GaussRule gauss = numerics::gauss_legendre(20);
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

Value integrate(const Transform& transform, double r) {
  Value value;
  for (std::size_t i = 0; i < transform.x.size(); ++i) {
    const double xr = transform.x[i] * r;
    const double bessel_0 = ::j0(xr);
    value.s += transform.s_weight[i] * bessel_0;
    value.d += transform.d_weight[i] * bessel_2(xr, bessel_0, ::j1(xr));
  }
  return value;
}

/// sum of c_k T_k(t) on [-1, 1]
struct ChebyshevSeries {
  std::vector<Value> c;
  Value at(double t) const {
    Value next, after;
    for (std::size_t k = c.size() - 1; k > 0; --k) {  // Clenshaw
      const Value now = {2 * t * next.s - after.s + c[k].s, 2 * t * next.d - after.d + c[k].d};
      after = next;
      next = now;
    }
    return {t * next.s - after.s + c[0].s, t * next.d - after.d + c[0].d};
  }
};

/// Through values at the Chebyshev nodes.
ChebyshevSeries chebyshev_series(const std::vector<Value>& values) {
  const int n = static_cast<int>(values.size());
  ChebyshevSeries series;
  for (int k = 0; k < n; ++k) {
    Value sum;
    for (int node = 0; node < n; ++node) {
      const double weight = (k == 0 ? 1.0 : 2.0) / n * std::cos(k * pi * (node + 0.5) / n);
      sum = {sum.s + weight * values[node].s, sum.d + weight * values[node].d};
    }
    series.c.push_back(sum);
  }
  return series;
}

/// The same polynomial in powers of t.
LayerTable::Piece monomials(const ChebyshevSeries& series) {
  LayerTable::Piece powers{};
  std::array<double, kOrder> before{}, now{};  // coefficients of T_(k-1), T_k
  now[0] = 1;
  for (int k = 0; k < kOrder; ++k) {
    std::array<double, kOrder> next{};
    for (int i = 0; i < kOrder; ++i) {
      powers[i] = {powers[i].s + series.c[k].s * now[i], powers[i].d + series.c[k].d * now[i]};
      if (i + 1 < kOrder) next[i + 1] += (k == 0 ? 1 : 2) * now[i];
      next[i] -= before[i];
    }
    before = now;
    now = next;
  }
  return powers;
}

/// S I + D (2 e e^T - I)
Sym2 tensor(Value value, Vec2 offset, double squared) {
  const double per_square = squared > 0 ? value.d / squared : 0;
  const double difference = per_square * (offset.x * offset.x - offset.y * offset.y);
  return {value.s + difference, 2 * per_square * offset.x * offset.y, value.s - difference};
}

}  // namespace

LayerTable::Value LayerTable::correction(double r) const {
  // beyond the reach: what cancels the half-space's
  if (r >= kReach) return {-(2 - poisson_ratio_) / (2 * r), -poisson_ratio_ / (2 * r)};
  const double scaled = kPiecesPerUnit * r;
  const int index = static_cast<int>(scaled);
  const double t = 2 * (scaled - index) - 1, t2 = t * t, t4 = t2 * t2;
  // both at once, in halves (Estrin): the processor need not wait for one term to take up the next
  using Pair = double __attribute__((vector_size(sizeof(Value)), aligned(alignof(Value)), may_alias));
  const auto* c = reinterpret_cast<const Pair*>(pieces_[index].data());
  const Pair sum = (c[0] + c[1] * t) + (c[2] + c[3] * t) * t2 + ((c[4] + c[5] * t) + (c[6] + c[7] * t) * t2) * t4;
  static_assert(kOrder == 8);
  return {sum[0], sum[1]};
}

LayerTable::LayerTable(double poisson_ratio) : poisson_ratio_(poisson_ratio) {
  const Transform factors = transform(poisson_ratio);
  pieces_.reserve(static_cast<std::size_t>(kReach) * kPiecesPerUnit);
  for (int unit = 0; unit < static_cast<int>(kReach); ++unit) {
    std::vector<Value> values;
    for (int node = 0; node < kUnitOrder; ++node) {
      values.push_back(integrate(factors, unit + 0.5 * (1 + chebyshev_node(kUnitOrder, node))));
    }
    const ChebyshevSeries whole = chebyshev_series(values);
    for (int k = 0; k < kPiecesPerUnit; ++k) {
      values.clear();
      for (int node = 0; node < kOrder; ++node) {
        values.push_back(whole.at((2 * k + 1 + chebyshev_node(kOrder, node)) / kPiecesPerUnit - 1));
      }
      pieces_.push_back(monomials(chebyshev_series(values)));
    }
  }
}

LayerTable::Value layer_correction_at_force(double poisson_ratio) { return integrate(transform(poisson_ratio), 0); }

Layer::Layer(const Gel& gel)
    : gel_((mbtfm::check(gel), gel)),
      table_(gel.poisson_ratio),
      scale_(1 / (2 * pi * substrate::shear_modulus_kPa(gel) * gel.thickness_um)),
      per_thickness_(1 / gel.thickness_um) {}

Sym2 Layer::point_correction_um_per_nN(Vec2 offset_um) const {
  const double squared = dot(offset_um, offset_um);
  const double r = std::sqrt(squared) * per_thickness_;
  return scale_ * tensor(table_.correction(r), offset_um, squared);
}

Sym2 Layer::mean_correction_um_per_nN(Vec2 offset_um, const std::vector<substrate::DiscPoint>& rule) const {
  double even = 0, difference = 0, xy = 0;
  for (const substrate::DiscPoint& p : rule) {
    const Vec2 offset = offset_um - p.position;
    const double squared = dot(offset, offset);
    const Value value = table_.correction(std::sqrt(squared) * per_thickness_);
    const double per_square = squared > 0 ? p.weight * value.d / squared : 0;
    even += p.weight * value.s;
    difference += per_square * (offset.x * offset.x - offset.y * offset.y);
    xy += 2 * per_square * offset.x * offset.y;
  }
  return scale_ * Sym2{even + difference, xy, even - difference};
}

Sym2 Layer::point_compliance_um_per_nN(Vec2 offset_um) const {
  const double squared = dot(offset_um, offset_um);
  const double r = std::sqrt(squared) * per_thickness_;
  if (r >= LayerTable::kReach) return {};
  LayerTable::Value value = table_.correction(r);
  value.s += (2 - gel_.poisson_ratio) / (2 * r);
  value.d += gel_.poisson_ratio / (2 * r);
  return scale_ * tensor(value, offset_um, squared);
}

LayerEllipse::LayerEllipse(const Layer& layer, const substrate::Ellipse& ellipse)
    : layer_(layer), ellipse_(ellipse), half_space_(layer.gel(), ellipse) {
  // A function whose nearest singularity lies at z semi-axes beside the ellipse is averaged by a rule of degree n to
  // about q^(n+1), q = 1/(z + sqrt(z² + 1)); the correction has its own at z = 2 h / a, up or down.
  const double z = 2 * layer.gel().thickness_um / ellipse.semi_major_um;
  const double q = 1 / (z + std::sqrt(z * z + 1));
  const int degree = static_cast<int>(std::ceil(std::log(kAverageTolerance) / std::log(q))) - 1;
  correction_rule_ = substrate::ellipse_rule(ellipse, std::max(3, degree));
  // A series or rule of degree n errs by (a/r)^(n+1) in powers of r: below the tolerance from these ratios on.
  const auto ratio = [](int order) { return std::pow(kAverageTolerance, -1.0 / (order + 1)); };
  far_from_um_ = ratio(5) * ellipse.semi_major_um;
  // Far away the two halves of a small difference must not part: a rule takes the whole field. In the layer's
  // exp(-0.74 r/h) it errs by (0.74 a/h)^(n+1) / (n+1)!.
  whole_from_um_ = 6 * layer.gel().thickness_um;
  const int whole_degree = ratio(3) * ellipse.semi_major_um <= whole_from_um_ ? 3 : 5;
  if (whole_degree == 5) whole_from_um_ = std::max(whole_from_um_, far_from_um_);
  whole_rule_ = substrate::ellipse_rule(ellipse, whole_degree);
}

Sym2 LayerEllipse::compliance_um_per_nN(Vec2 point_um) const {
  const Vec2 offset = point_um - ellipse_.centre_um;
  const double distance = std::sqrt(dot(offset, offset));
  if (distance > LayerTable::kReach * layer_.gel().thickness_um + ellipse_.semi_major_um) return {};
  if (distance >= whole_from_um_) {
    Sym2 sum;
    for (const substrate::DiscPoint& p : whole_rule_)
      sum += p.weight * layer_.point_compliance_um_per_nN(offset - p.position);
    return sum;
  }
  Sym2 sum = distance < far_from_um_ ? half_space_.compliance_um_per_nN(point_um)
                                     : half_space_.far_compliance_um_per_nN(point_um);
  return sum += layer_.mean_correction_um_per_nN(offset, correction_rule_);
}

namespace {

/// x asinh(y / |x|), whose limit at x = 0 is 0
double corner_term(double x, double y) { return x == 0 ? 0 : x * std::asinh(y / std::abs(x)); }

}  // namespace

Sym2 square_compliance_um_per_kPa(const Gel& gel, double side_um, Vec2 offset_um) {
  const double nu = gel.poisson_ratio;
  const double scale = 1 / (2 * std::numbers::pi * substrate::shear_modulus_kPa(gel));
  Sym2 sum;
  for (const double sign_x : {1.0, -1.0}) {
    for (const double sign_y : {1.0, -1.0}) {
      const double x = offset_um.x + 0.5 * sign_x * side_um, y = offset_um.y + 0.5 * sign_y * side_um;
      const double over_x = corner_term(x, y), over_y = corner_term(y, x);
      sum += (scale * sign_x * sign_y) *
             Sym2{(1 - nu) * over_x + over_y, -nu * std::hypot(x, y), over_x + (1 - nu) * over_y};
    }
  }
  return sum;
}

Sym2 square_compliance_um_per_kPa(const Layer& layer, double side_um, Vec2 offset_um) {
  Sym2 sum = square_compliance_um_per_kPa(layer.gel(), side_um, offset_um);
  const double gauss = 0.5 * side_um / std::sqrt(3.0);
  for (const Vec2 p : {Vec2{gauss, gauss}, {gauss, -gauss}, {-gauss, gauss}, {-gauss, -gauss}}) {
    sum += (0.25 * side_um * side_um) * layer.point_correction_um_per_nN(offset_um - p);
  }
  return sum;
}

}  // namespace mbtfm::greens
