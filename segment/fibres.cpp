#include "segment/fibres.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "segment/fibre_ends.h"
#include "segment/fibre_profile.h"
#include "segment/grid.h"
#include "segment/trace.h"

namespace mbtfm::segment {

namespace {

/// Full width at half maximum of a Gaussian in standard deviations.
constexpr double kFwhm = 2.3548;

/// The image shrunk until the narrowest filter spans no more pixels than it needs.
struct Working {
  cv::Mat image;
  double pixel_um;
};

Working working_image(const cv::Mat& image, double pixel_size_um, double narrowest_sigma_um) {
  // a Gaussian of 1.2 pixels is sampled to within 1e-3 of its spectrum
  const int factor = std::max(1, static_cast<int>(narrowest_sigma_um / (1.2 * pixel_size_um)));
  return {shrink(image, factor), pixel_size_um * factor};
}

/// Height that only a tenth of the clear ridge points exceed; 0 without any.
double bright_height(const Ridges& ridges, double start_noise) {
  std::vector<float> heights;
  for (int y = 0; y < ridges.noise.rows; ++y)
    for (int x = 0; x < ridges.noise.cols; ++x)
      if (ridges.strongest.at<float>(y, x) > 2 * start_noise * ridges.noise.at<float>(y, x))
        heights.push_back(ridges.strongest.at<float>(y, x));
  return heights.empty() ? 0 : quantile(cv::Mat(heights), 0.9);
}

TraceRule rule_of(const FibreParameters& p, double bright, double pixel_um) {
  TraceRule rule;
  rule.start_noise = p.fibre_start_noise;
  rule.follow_noise = p.fibre_follow_noise;
  rule.floor = p.fibre_faintest * bright;
  rule.memory_px = 4 * p.fibre_averaging_um / pixel_um;
  rule.gap_px = p.fibre_gap_um / pixel_um;
  rule.smallest_radius_px = p.fibre_smallest_radius_um / pixel_um;
  rule.line_radius_px = 0.75 * p.fibre_width_um / pixel_um;
  rule.shortest_px = p.fibre_shortest_um / pixel_um;
  rule.end_window_px = 4 * p.fibre_averaging_um / pixel_um;
  rule.join_gap_px = 1.5 * p.fibre_gap_um / pixel_um;
  return rule;
}

/// Mean of neighbours over ± half a window that shrinks towards the ends, which stay.
std::vector<cv::Point2d> smoothed(const std::vector<cv::Point2d>& points, int half_window) {
  const int n = static_cast<int>(points.size());
  std::vector<cv::Point2d> result(points.size());
  for (int i = 0; i < n; ++i) {
    const int h = std::min({half_window, i, n - 1 - i});
    cv::Point2d sum(0, 0);
    for (int k = i - h; k <= i + h; ++k) sum += points[static_cast<std::size_t>(k)];
    result[static_cast<std::size_t>(i)] = sum / (2 * h + 1);
  }
  return result;
}

/// Douglas–Peucker between first and last, both kept.
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

Polyline simplified(const Polyline& line, double tolerance_um) {
  Polyline kept{line.front()};
  simplify(line, 0, line.size() - 1, tolerance_um, kept);
  return kept;
}

bool falls_on_both_sides(const Profile& profile, double ratio) {
  return profile.lower_drop >= ratio * profile.upper_drop && profile.lower_drop > 3 * profile.noise;
}

/// Does the line run along the outline at this point?
bool hugs(const Polygon& outline_um, Vec2 point, Vec2 along, double distance_um) {
  if (outline_um.empty()) return false;
  const Vec2 nearest = nearest_on_boundary_um(outline_um, point);
  if (!contains(outline_um, point)) return true;
  const Vec2 away = point - nearest;
  constexpr double kParallel = 0.5;  // sine of 30°
  return norm(away) < distance_um && std::abs(dot(away, along)) <= kParallel * norm(away) * norm(along);
}

/// The longest piece of the line that does not run along the outline.
Polyline without_edge(const Polyline& line, const Polygon& outline_um, double distance_um) {
  std::size_t best_first = 0, best_n = 0, first = 0;
  for (std::size_t i = 0; i <= line.size(); ++i) {
    const std::size_t a = i > 2 ? i - 3 : 0, b = std::min(i + 3, line.size() - 1);
    if (i < line.size() && !hugs(outline_um, line[i], line[b] - line[a], distance_um)) continue;
    if (i - first > best_n) best_first = first, best_n = i - first;
    first = i + 1;
  }
  return {line.begin() + static_cast<std::ptrdiff_t>(best_first),
          line.begin() + static_cast<std::ptrdiff_t>(best_first + best_n)};
}

}  // namespace

void declare(ParameterList& list, FibreParameters& p) {
  list.table("segment");
  list.add("fibre_width_um", p.fibre_width_um, Range::positive(),
           "typical width of a fibre; half to twice of it is found (um)");
  list.add("fibre_averaging_um", p.fibre_averaging_um, Range::positive(),
           "averaging along the fibre (standard deviation, um)");
  list.add("fibre_start_noise", p.fibre_start_noise, Range::positive(),
           "height a fibre reaches somewhere (standard deviations of the filtered noise)");
  list.add("fibre_follow_noise", p.fibre_follow_noise, Range::positive(),
           "height it may fall to (standard deviations of the filtered noise)");
  list.add("fibre_faintest", p.fibre_faintest, Range::between(0, 1),
           "least height as a share of the height of bright fibres");
  list.add("fibre_contrast", p.fibre_contrast, Range::not_negative(),
           "least height as a share of the brightness beside the fibre");
  list.add("fibre_smallest_radius_um", p.fibre_smallest_radius_um, Range::positive(),
           "smallest radius of curvature (um)");
  list.add("fibre_edge_um", p.fibre_edge_um, Range::not_negative(),
           "a line along the outline this near to it is the cell's edge, not a fibre (um)");
  list.add("fibre_edge_height", p.fibre_edge_height, Range::not_negative(),
           "unless it reaches this share of the height of bright fibres");
  list.add("fibre_gap_um", p.fibre_gap_um, Range::not_negative(), "length over which a fibre may be invisible (um)");
  list.add("fibre_shortest_um", p.fibre_shortest_um, Range::positive(), "shortest fibre (um)");
  list.add("fibre_side_ratio", p.fibre_side_ratio, Range::between(0, 1),
           "least drop to one side as a share of the drop to the other");
  list.add("fibre_reach_um", p.fibre_reach_um, Range::positive(), "an end this near to an adhesion is held by it (um)");
  list.add("fibre_simplify_um", p.fibre_simplify_um, Range::positive(),
           "points are left out where the line moves less (um)");
}

std::vector<Fibre> find_fibres(const Image& image, const Polygon& outline_um, const std::vector<Adhesion>& adhesions,
                               double pixel_size_um, const FibreParameters& p) {
  const cv::Mat full = matrix_of(image);
  const double typical_sigma_um = p.fibre_width_um / kFwhm;
  const Working working = working_image(full, pixel_size_um, typical_sigma_um / std::sqrt(2.0));
  RidgeScales scales;
  for (const double s : {1 / std::sqrt(2.0), std::sqrt(2.0)})
    scales.width_sigma_px.push_back(s * typical_sigma_um / working.pixel_um);
  scales.length_sigma_px = p.fibre_averaging_um / working.pixel_um;
  scales.noise_radius_px = std::max(6.0, 8 * p.fibre_width_um / working.pixel_um);
  const Ridges ridges = find_ridges(working.image, scales);
  const double bright = bright_height(ridges, p.fibre_start_noise), dark = quantile(working.image, 0.01);
  const int window = static_cast<int>(std::lround(p.fibre_averaging_um / working.pixel_um));
  std::vector<Fibre> fibres;
  for (const Trace& trace : trace_lines(ridges, rule_of(p, bright, working.pixel_um))) {
    const auto points = smoothed(trace.points, window);
    const Profile profile = profile_across(working.image, points, 1.5 * p.fibre_width_um / working.pixel_um);
    if (!falls_on_both_sides(profile, p.fibre_side_ratio)) continue;
    if (profile.height < p.fibre_contrast * (profile.side - dark)) continue;
    Fibre fibre;
    for (const cv::Point2d& point : points) fibre.points_um.push_back(to_um(point, working.pixel_um));
    const bool is_bright = profile.height >= p.fibre_edge_height * bright;
    fibre.points_um = without_edge(fibre.points_um, outline_um, is_bright ? 0 : p.fibre_edge_um);
    if (fibre.points_um.size() < 2) continue;
    fibre.points_um = simplified(fibre.points_um, p.fibre_simplify_um);
    fibre.width_um = profile.width_px * working.pixel_um;
    fibre.mean_intensity = profile.height;
    tie_ends(fibre, adhesions, p.fibre_reach_um);
    if (fibre.points_um.size() >= 2 && length_um(fibre.points_um) >= p.fibre_shortest_um) fibres.push_back(fibre);
  }
  std::stable_sort(fibres.begin(), fibres.end(),
                   [](const Fibre& a, const Fibre& b) { return length_um(a.points_um) > length_um(b.points_um); });
  for (std::size_t i = 0; i < fibres.size(); ++i) fibres[i].fibre_id = static_cast<int>(i) + 1;
  return fibres;
}

}  // namespace mbtfm::segment
