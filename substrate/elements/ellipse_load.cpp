#include "substrate/elements/ellipse_load.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/numerics/quadrature.h"
#include "substrate/ellipse.h"

namespace mbtfm::elements {

using std::numbers::pi;

namespace {

// With y = Y sin t the ellipse spans x = P sin t -+ W cos t, about its centre: smooth in t, up to its very tips.
struct Span {
  Vec2 extent;
  double p, w;
};

Span span_of(const substrate::Ellipse& ellipse) {
  const double a = ellipse.semi_major_um, b = ellipse.semi_minor_um;
  const Vec2 extent = substrate::half_extent_um(ellipse);
  return {.extent = extent,
          .p = (a * a - b * b) * std::cos(ellipse.angle_rad) * std::sin(ellipse.angle_rad) / extent.y,
          .w = a * b / extent.y};
}

/// Add the t in (low, high) where either flank of the ellipse crosses x.
void add_crossings(std::vector<double>& breaks, const Span& span, double x, double low, double high) {
  if (std::abs(x) >= span.extent.x) return;
  const double angle = std::asin(x / span.extent.x);
  const double phase = std::atan2(span.w, span.p);
  for (const double flank : {phase, -phase}) {  // P sin t + W cos t = X sin(t + phase), and with -W
    for (const double turned : {angle - flank, pi - angle - flank}) {
      const double t = std::remainder(turned, 2 * pi);
      if (t > low && t < high) breaks.push_back(t);
    }
  }
}

// over a part of at most a half turn of t: 16 Gauss points take cos t times a polynomial of degree 4 to 1e-14
constexpr int kOuter = 16;
constexpr int kInner = 3;

}  // namespace

std::vector<substrate::DiscPoint> clipped_ellipse_rule(const substrate::Ellipse& ellipse, const Extent& rectangle) {
  static const numerics::GaussRule outer = numerics::gauss_legendre(kOuter);
  static const numerics::GaussRule inner = numerics::gauss_legendre(kInner);
  const Span span = span_of(ellipse);
  const Vec2 low = rectangle.low_um - ellipse.centre_um;
  const Vec2 high = rectangle.high_um - ellipse.centre_um;
  std::vector<substrate::DiscPoint> rule;
  if (low.x >= span.extent.x || high.x <= -span.extent.x) return rule;
  const double t_low = std::asin(std::clamp(low.y / span.extent.y, -1.0, 1.0));
  const double t_high = std::asin(std::clamp(high.y / span.extent.y, -1.0, 1.0));
  std::vector<double> breaks = {t_low, t_high};
  add_crossings(breaks, span, low.x, t_low, t_high);
  add_crossings(breaks, span, high.x, t_low, t_high);
  std::sort(breaks.begin(), breaks.end());
  const double area = pi * ellipse.semi_major_um * ellipse.semi_minor_um;
  for (std::size_t part = 1; part < breaks.size(); ++part) {
    const double half = 0.5 * (breaks[part] - breaks[part - 1]);
    const double middle = 0.5 * (breaks[part] + breaks[part - 1]);
    for (int i = 0; i < kOuter; ++i) {
      const double t = middle + half * outer.nodes[i];
      const double sin = std::sin(t);
      const double cos = std::cos(t);
      const double left = std::max(low.x, span.p * sin - span.w * cos);
      const double right = std::min(high.x, span.p * sin + span.w * cos);
      if (right <= left) continue;
      const double weight = half * outer.weights[i] * span.extent.y * cos * 0.5 * (right - left) / area;
      for (int k = 0; k < kInner; ++k) {
        const double x = 0.5 * (left + right) + 0.5 * (right - left) * inner.nodes[k];
        rule.push_back({ellipse.centre_um + Vec2{x, span.extent.y * sin}, weight * inner.weights[k]});
      }
    }
  }
  return rule;
}

}  // namespace mbtfm::elements
