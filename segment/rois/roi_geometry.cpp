#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/errors.h"
#include "segment/rois/roi.h"

namespace mbtfm::rois {
namespace {

/// The natural cubic spline through values at increasing places (Thomas' algorithm for its second derivatives).
class NaturalSpline {
 public:
  NaturalSpline(std::vector<double> places, std::vector<double> values)
      : places_(std::move(places)), values_(std::move(values)), bends_(values_.size(), 0.0) {
    const std::size_t n = values_.size();
    std::vector<double> above(n, 0.0);
    for (std::size_t i = 1; i + 1 < n; ++i) {
      const double before = places_[i] - places_[i - 1], after = places_[i + 1] - places_[i];
      const double pivot = 2 * (before + after) - before * above[i - 1];
      const double kink = (values_[i + 1] - values_[i]) / after - (values_[i] - values_[i - 1]) / before;
      above[i] = after / pivot;
      bends_[i] = (6 * kink - before * bends_[i - 1]) / pivot;
    }
    for (std::size_t i = n - 1; i-- > 1;) bends_[i] -= above[i] * bends_[i + 1];
  }
  double at(double place) const {
    const auto next = std::upper_bound(places_.begin() + 1, places_.end() - 1, place);
    const auto i = static_cast<std::size_t>(next - places_.begin()) - 1;
    const double h = places_[i + 1] - places_[i], b = (place - places_[i]) / h, a = 1 - b;
    return a * values_[i] + b * values_[i + 1] +
           ((a * a * a - a) * bends_[i] + (b * b * b - b) * bends_[i + 1]) * h * h / 6;
  }

 private:
  std::vector<double> places_, values_, bends_;
};

std::vector<Vec2> without_repetition(const std::vector<Vec2>& points) {
  std::vector<Vec2> different;
  for (const Vec2 p : points)
    if (different.empty() || !(p == different.back())) different.push_back(p);
  return different;
}

/// The curve that ImageJ draws through the nodes: natural cubic splines of x and y over the sum of the square roots of
/// the nodes' distances; a closed one repeats up to 7 nodes at either end (SplineFitter). A point every two pixels of
/// the nodes' line, at least 100 (PolygonRoi.fitSpline).
std::vector<Vec2> spline_through(std::vector<Vec2> nodes, bool is_closed) {
  nodes = without_repetition(nodes);
  if (is_closed && !nodes.empty() && !(nodes.front() == nodes.back())) nodes.push_back(nodes.front());
  const std::size_t n = nodes.size();
  if (n < 3) return nodes;
  std::vector<double> own(n, 0.0);
  for (std::size_t i = 1; i < n; ++i) own[i] = own[i - 1] + std::sqrt(norm(nodes[i] - nodes[i - 1]));
  const std::size_t n_repeated = is_closed ? std::min<std::size_t>(7, n - 1) : 0;
  std::vector<double> places, x, y;
  const auto add = [&](double place, Vec2 node) {
    places.push_back(place);
    x.push_back(node.x);
    y.push_back(node.y);
  };
  for (std::size_t i = n - 1 - n_repeated; i + 1 < n; ++i) add(own[i] - own.back(), nodes[i]);
  for (std::size_t i = 0; i < n; ++i) add(own[i], nodes[i]);
  for (std::size_t i = 1; i <= n_repeated; ++i) add(own[i] + own.back(), nodes[i]);
  const NaturalSpline spline_x(places, x), spline_y(places, y);
  const auto n_points = std::max<std::size_t>(100, static_cast<std::size_t>(length_um(nodes) / 2));
  std::vector<Vec2> curve;
  for (std::size_t i = 0; i < n_points; ++i) {
    const double place = own.back() * static_cast<double>(i) / static_cast<double>(n_points - 1);
    curve.push_back({spline_x.at(place), spline_y.at(place)});
  }
  return curve;
}

/// Points of the ellipse of semi-axes a along `along` and b across it, from angle `from` over `turn`.
void add_arc(Polygon& polygon, Vec2 centre, Vec2 along, double a, double b, double from, double turn, int n) {
  const Vec2 across{-along.y, along.x};
  for (int i = 0; i < n; ++i) {
    const double phi = from + turn * i / n;
    polygon.push_back(centre + a * std::cos(phi) * along + b * std::sin(phi) * across);
  }
}

Polygon rectangle_corners(const Roi& roi) {
  const Vec2 low = roi.corner_px, high = low + roi.size_px;
  const double r_x = std::min(roi.corner_diameter_px, roi.size_px.x) / 2;
  const double r_y = std::min(roi.corner_diameter_px, roi.size_px.y) / 2;
  if (r_x <= 0 || r_y <= 0) return {low, {high.x, low.y}, high, {low.x, high.y}};
  Polygon polygon;
  const Vec2 centres[] = {
      {high.x - r_x, high.y - r_y}, {low.x + r_x, high.y - r_y}, low + Vec2{r_x, r_y}, {high.x - r_x, low.y + r_y}};
  constexpr int kByCorner = 32;
  for (int i = 0; i < 4; ++i) {
    // both ends of the quarter belong to it
    add_arc(polygon, centres[i], {1, 0}, r_x, r_y, i * std::numbers::pi / 2,
            std::numbers::pi / 2 * kByCorner / (kByCorner - 1), kByCorner);
  }
  return polygon;
}

/// From the first path's begin to each further one, round it, and back.
Polygon joined(const std::vector<Polygon>& paths) {
  Polygon line;
  for (const Polygon& path : paths) {
    line.insert(line.end(), path.begin(), path.end());
    line.push_back(path.front());
    if (&path != &paths.front()) line.push_back(paths.front().front());
  }
  return line;
}

}  // namespace

Roi binned(Roi roi, int binning) {
  const double scale = 1.0 / binning, origin = is_line(roi.shape) ? 0.5 : 0;  // see the top of roi.h
  const auto shrink = [&](std::vector<Vec2>& points) {
    for (Vec2& p : points) p = scale * (p + Vec2{origin, origin}) - Vec2{origin, origin};
  };
  shrink(roi.points_px);
  for (Polygon& path : roi.paths_px) shrink(path);
  roi.corner_px = scale * roi.corner_px;
  roi.size_px = scale * roi.size_px;
  roi.corner_diameter_px *= scale;
  roi.stroke_width_px *= scale;
  return roi;
}

Polyline line_px(const Roi& roi) {
  MBTFM_ASSERT(is_line(roi.shape));
  Polyline line = roi.is_spline ? spline_through(roi.points_px, false) : roi.points_px;
  for (Vec2& point : line) point += {0.5, 0.5};
  return line;
}

Polygon area_px(const Roi& roi) {
  MBTFM_ASSERT(is_area(roi.shape));
  constexpr int kRound = 360;
  Polygon polygon;
  switch (roi.shape) {
    case RoiShape::rectangle:
      return rectangle_corners(roi);
    case RoiShape::composite:
      return joined(roi.paths_px);
    case RoiShape::oval:
      add_arc(polygon, roi.corner_px + 0.5 * roi.size_px, {1, 0}, roi.size_px.x / 2, roi.size_px.y / 2, 0,
              2 * std::numbers::pi, kRound);
      return polygon;
    case RoiShape::ellipse: {
      const Vec2 axis = roi.points_px[1] - roi.points_px[0];
      const double major = norm(axis);
      const Vec2 along = major > 0 ? (1 / major) * axis : Vec2{1, 0};
      add_arc(polygon, roi.points_px[0] + 0.5 * axis, along, major / 2, roi.aspect_ratio * major / 2, 0,
              2 * std::numbers::pi, kRound);
      return polygon;
    }
    default:
      return roi.is_spline ? spline_through(roi.points_px, true) : roi.points_px;
  }
}

}  // namespace mbtfm::rois
