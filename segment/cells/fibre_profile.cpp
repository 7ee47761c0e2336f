#include "segment/cells/fibre_profile.h"

#include <algorithm>
#include <cmath>

#include "pipeline/numerics/order_statistics.h"
#include "segment/cells/grid.h"

namespace mbtfm::cells {
namespace {

/// Between first and last, both kept.
void simplify(const Polyline& line, std::size_t first, std::size_t last, double tolerance_um, Polyline& kept) {
  const Vec2 d = line[last] - line[first];
  const double l = norm(d);
  std::size_t farthest = first;
  double greatest = tolerance_um;
  for (std::size_t i = first + 1; i < last; ++i) {
    const Vec2 r = line[i] - line[first];
    const double distance = l > 0 ? std::abs(cross(d, r)) / l : norm(r);
    if (distance > greatest) greatest = distance, farthest = i;
  }
  if (farthest != first) {
    simplify(line, first, farthest, tolerance_um, kept);
    simplify(line, farthest, last, tolerance_um, kept);
  } else {
    kept.push_back(line[last]);
  }
}

/// Does the line run along the outline at this point?
bool hugs(const Polygon& outline_um, Vec2 point, Vec2 along, double distance_um) {
  if (!contains(outline_um, point)) return true;
  const Vec2 away = point - nearest_on_boundary_um(outline_um, point);
  constexpr double kParallel = 0.5;  // sine of 30°
  return norm(away) < distance_um && std::abs(dot(away, along)) <= kParallel * norm(away) * norm(along);
}

}  // namespace

std::vector<cv::Point2d> smoothed(const std::vector<cv::Point2d>& points, int half_window) {
  const int n = static_cast<int>(points.size());
  std::vector<cv::Point2d> result(points.size());
  for (int i = 0; i < n; ++i) {
    const int h = std::min({half_window, i, n - 1 - i});
    cv::Point2d sum(0, 0);
    for (int k = i - h; k <= i + h; ++k) sum += points[k];
    result[i] = sum / (2 * h + 1);
  }
  return result;
}

Piece without_edge(const Polyline& line, const Polygon& outline_um, double distance_um) {
  if (outline_um.empty()) return {0, line.size()};
  Piece best;
  std::size_t first = 0;
  for (std::size_t i = 0; i <= line.size(); ++i) {
    const std::size_t a = i > 2 ? i - 3 : 0, b = std::min(i + 3, line.size() - 1);
    if (i < line.size() && !hugs(outline_um, line[i], line[b] - line[a], distance_um)) continue;
    if (i - first > best.n) best = {first, i - first};
    first = i + 1;
  }
  return best;
}

Polyline simplified(const Polyline& line, double tolerance_um) {
  Polyline kept{line.front()};
  simplify(line, 0, line.size() - 1, tolerance_um, kept);
  return kept;
}

namespace {

constexpr double kColumnStep = 0.5;  // px: bilinear samples carry no more

struct Column {
  double level;
  double error;  ///< of its difference from the line's own level: brightness that varies along the line cancels
};

/// Level of the image at a distance `offset` from the line (positive to the left), over all its points.
Column column_at(const cv::Mat& image, const std::vector<cv::Point2d>& points, double offset) {
  std::vector<float> values(points.size()), differences(points.size());
  for (std::size_t i = 0; i < points.size(); ++i) {
    const std::size_t a = i > 2 ? i - 3 : 0, b = std::min(i + 3, points.size() - 1);
    const cv::Point2d d = points[b] - points[a];
    const double l = std::max(1e-9, std::hypot(d.x, d.y));
    values[i] = sample(image, points[i] + (offset / l) * cv::Point2d(-d.y, d.x));
    differences[i] = values[i] - sample(image, points[i]);
  }
  const auto difference = static_cast<float>(numerics::median_in(differences));
  for (float& d : differences) d = std::abs(d - difference);
  const double error = 1.4826 * numerics::median_in(differences) / std::sqrt(static_cast<double>(values.size()));
  return {numerics::median_in(values), error};
}

/// Where the profile falls to `level` going out from `middle` in steps of `direction`, in columns from the middle.
double half_width(const std::vector<Column>& profile, int middle, int direction, double level) {
  const int n = static_cast<int>(profile.size());
  int i = middle;
  while (i + direction >= 0 && i + direction < n && profile[i].level > level) i += direction;
  if (i == middle) return 0;
  const double inner = profile[i - direction].level, outer = profile[i].level;
  const double part = inner > outer ? std::clamp((inner - level) / (inner - outer), 0.0, 1.0) : 1;
  return std::abs(i - middle) - 1 + part;
}

}  // namespace

Profile profile_across(const cv::Mat& image, const std::vector<cv::Point2d>& points, double reach_px) {
  const int half = std::max(2, static_cast<int>(std::ceil(reach_px / kColumnStep)));
  std::vector<Column> columns;
  for (int i = -half; i <= half; ++i) columns.push_back(column_at(image, points, i * kColumnStep));
  const auto lowest = [&](int from, int to) {
    return *std::min_element(columns.begin() + from, columns.begin() + to,
                             [](const Column& a, const Column& b) { return a.level < b.level; });
  };
  const Column right = lowest(0, half), left = lowest(half + 1, 2 * half + 1);
  const int peak =
      static_cast<int>(std::max_element(columns.begin() + half / 2, columns.begin() + half + half / 2 + 1,
                                        [](const Column& a, const Column& b) { return a.level < b.level; }) -
                       columns.begin());
  const double top = columns[peak].level;
  Profile p;
  p.lower_drop = std::max(0.0, top - std::max(left.level, right.level));
  p.upper_drop = std::max(0.0, top - std::min(left.level, right.level));
  p.height = (p.lower_drop + p.upper_drop) / 2;
  p.side = top - p.height;
  p.noise = std::hypot(columns[peak].error, std::max(left.error, right.error));
  p.width_px = kColumnStep * (half_width(columns, peak, -1, top - (top - right.level) / 2) +
                              half_width(columns, peak, +1, top - (top - left.level) / 2));
  return p;
}

}  // namespace mbtfm::cells
