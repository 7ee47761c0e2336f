#include "continuum/sheet/elements.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::sheet {
namespace {

struct Local {
  std::array<double, 6> value;
  std::array<Vec2, 6> slope;  ///< by r and s
};

Local local_at(double r, double s) {
  const double q = 1 - r - s;
  return {{q * (2 * q - 1), r * (2 * r - 1), s * (2 * s - 1), 4 * q * r, 4 * r * s, 4 * s * q},
          {Vec2{1 - 4 * q, 1 - 4 * q},
           {4 * r - 1, 0},
           {0, 4 * s - 1},
           {4 * (q - r), -4 * r},
           {4 * s, 4 * r},
           {-4 * s, 4 * (q - s)}}};
}

struct RulePoint {
  double r, s, weight;  ///< weights sum to 1
};

/// Source: Radon (1948); Stroud, Approximate Calculation of Multiple Integrals (1971), T2: 5-1.
std::array<RulePoint, Elements::kPoints> radon_rule() {
  const double root = std::sqrt(15.0);
  const double a = (6 - root) / 21, b = (6 + root) / 21;
  const double wa = (155 - root) / 1200, wb = (155 + root) / 1200;
  return {{{1.0 / 3, 1.0 / 3, 9.0 / 40},
           {a, a, wa},
           {1 - 2 * a, a, wa},
           {a, 1 - 2 * a, wa},
           {b, b, wb},
           {1 - 2 * b, b, wb},
           {b, 1 - 2 * b, wb}}};
}

}  // namespace

Shape Elements::shape(int triangle, double r, double s) const {
  const Local local = local_at(r, s);
  Vec2 by_r, by_s;
  Shape shape;
  shape.value = local.value;
  for (int i = 0; i < 6; ++i) {
    const Vec2 x = triangles_.nodes_um[nodes(triangle)[i]];
    shape.place_um += local.value[i] * x;
    by_r += local.slope[i].x * x;
    by_s += local.slope[i].y * x;
  }
  const double jacobian = cross(by_r, by_s);
  for (int i = 0; i < 6; ++i) {
    const Vec2 slope = local.slope[i];
    shape.gradient_per_um[i] = {(slope.x * by_s.y - slope.y * by_r.y) / jacobian,
                                (slope.y * by_r.x - slope.x * by_s.x) / jacobian};
  }
  shape.weight_um2 = 0.5 * jacobian;
  return shape;
}

Elements::Elements(Triangles triangles) : triangles_(std::move(triangles)) {
  static const auto rule = radon_rule();
  shapes_.resize(static_cast<std::size_t>(kPoints) * triangles_.nodes.size());
  for (int t = 0; t < n_triangles(); ++t) {
    for (int p = 0; p < kPoints; ++p) {
      Shape& at_point = shapes_[kPoints * t + p];
      at_point = shape(t, rule[p].r, rule[p].s);
      if (!(at_point.weight_um2 > 0))
        throw InvalidData(
            "the outline near (" + brief(at_point.place_um.x) + ", " + brief(at_point.place_um.y) + ") um",
            "a line that triangles can follow", "one that bends back within a triangle");
      at_point.weight_um2 *= rule[p].weight;
    }
  }
}

double Elements::area_um2(int triangle) const {
  double area = 0;
  for (int p = 0; p < kPoints; ++p) area += at(triangle, p).weight_um2;
  return area;
}

double Elements::area_um2() const {
  double area = 0;
  for (int t = 0; t < n_triangles(); ++t) area += area_um2(t);
  return area;
}

Locator::Locator(const Elements& elements) : elements_(elements) {
  const std::vector<Vec2>& nodes = elements.triangles().nodes_um;
  const auto [low, high] = extent_of(nodes);
  low_um_ = low;
  const Vec2 size = high - low;
  bin_um_ = std::sqrt(size.x * size.y / std::max(1, elements.n_triangles() / 2));
  columns_ = static_cast<int>(size.x / bin_um_) + 1;
  rows_ = static_cast<int>(size.y / bin_um_) + 1;
  bins_.resize(static_cast<std::size_t>(columns_) * rows_);
  for (int t = 0; t < elements.n_triangles(); ++t) {
    const auto [a, b] = extent_of(elements.nodes(t), [&](int node) { return nodes[node]; });
    const double reach = 0.05 * norm(b - a);
    const auto clamped = [](double v, int n) { return static_cast<int>(std::clamp(v, 0.0, n - 1.0)); };
    for (int y = clamped((a.y - reach - low_um_.y) / bin_um_, rows_);
         y <= clamped((b.y + reach - low_um_.y) / bin_um_, rows_); ++y)
      for (int x = clamped((a.x - reach - low_um_.x) / bin_um_, columns_);
           x <= clamped((b.x + reach - low_um_.x) / bin_um_, columns_); ++x)
        bins_[static_cast<std::size_t>(y) * columns_ + x].push_back(t);
  }
}

std::optional<Locator::Place> Locator::find(Vec2 point_um, double outside) const {
  const Vec2 at = 1 / bin_um_ * (point_um - low_um_);
  if (!(at.x > -1 && at.y > -1 && at.x < columns_ + 1 && at.y < rows_ + 1)) return std::nullopt;
  const int column = static_cast<int>(std::clamp(at.x, 0.0, columns_ - 1.0));
  const int row = static_cast<int>(std::clamp(at.y, 0.0, rows_ - 1.0));
  std::optional<Place> best;
  double best_inside = -outside;
  for (const int t : bins_[static_cast<std::size_t>(row) * columns_ + column]) {
    double r = 1.0 / 3, s = 1.0 / 3;
    for (int step = 0; step < 8; ++step) {  // Newton: a straight triangle takes one, a curved one three
      const Shape shape = elements_.shape(t, r, s);
      const Vec2 off = point_um - shape.place_um;
      // r and s are linear on the straight triangle; their gradients follow from those of the corner functions
      const Local local = local_at(r, s);
      Vec2 by_r, by_s;
      for (int i = 0; i < 6; ++i) {
        const Vec2 x = elements_.triangles().nodes_um[elements_.nodes(t)[i]];
        by_r += local.slope[i].x * x;
        by_s += local.slope[i].y * x;
      }
      const double jacobian = cross(by_r, by_s);
      const double dr = cross(off, by_s) / jacobian, ds = cross(by_r, off) / jacobian;
      r += dr;
      s += ds;
      if (std::abs(dr) + std::abs(ds) < 1e-12) break;
      if (std::abs(r) > 3 || std::abs(s) > 3) break;
    }
    const double inside = std::min({r, s, 1 - r - s});
    if (!(inside >= best_inside)) continue;
    best_inside = inside;
    best = Place{t, r, s};
    if (inside > 1e-9) break;
  }
  return best;
}

}  // namespace mbtfm::sheet
