#include "segment/cells/fibre_profile.h"

#include <algorithm>
#include <cmath>

#include "pipeline/numerics/order_statistics.h"
#include "segment/cells/grid.h"

namespace mbtfm::cells {
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
