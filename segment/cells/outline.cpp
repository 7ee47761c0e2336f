#include "segment/cells/outline.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "pipeline/stage/parameters.h"
#include "segment/cells/cell_mask.h"
#include "segment/cells/ellipse.h"
#include "segment/cells/grid.h"
#include "segment/cells/padding.h"

namespace mbtfm::cells {
namespace {

constexpr double kSmoothing_um = 0.3;  // just above the resolution of light: more would round the cell's corners
constexpr double kGrid_um = 0.4;       // pitch of the masks: a little more than the smoothing

/// @returns how far each adhesion's centre lies beyond the mask, before any is added (um)
std::vector<double> add_adhesions(cv::Mat& mask, const std::vector<Adhesion>& adhesions, double pixel_um,
                                  double reach_um) {
  cv::Mat distance, labels;
  cv::distanceTransform(~mask, distance, labels, cv::DIST_L2, 5, cv::DIST_LABEL_PIXEL);
  std::vector<cv::Point> cell_pixel(mask.total() + 1);  // the mask's pixel nearest to each point, by label
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x)
      if (mask.at<uchar>(y, x)) cell_pixel[labels.at<int>(y, x)] = {x, y};
  std::vector<double> beyond_um;
  for (const Adhesion& adhesion : adhesions) {
    const cv::Point2d centre = to_pixels(adhesion.position_um, pixel_um);
    const cv::Point c(std::clamp(cvRound(centre.x), 0, mask.cols - 1), std::clamp(cvRound(centre.y), 0, mask.rows - 1));
    beyond_um.push_back(distance.at<float>(c) * pixel_um);
    if (distance.at<float>(c) * pixel_um > reach_um) continue;
    const cv::Size axes(cvRound(adhesion.major_axis_um / 2 / pixel_um), cvRound(adhesion.minor_axis_um / 2 / pixel_um));
    cv::ellipse(mask, c, axes, adhesion.angle_rad * 180 / CV_PI, 0, 360, cv::Scalar(255), cv::FILLED);
    // a bridge of five pixels outlives the smoothing of the polygon
    if (distance.at<float>(c) > 0) cv::line(mask, c, cell_pixel[labels.at<int>(c)], cv::Scalar(255), 5);
  }
  return beyond_um;
}

/// Points at equal distances along a closed line.
std::vector<cv::Point2d> resampled(const std::vector<cv::Point2d>& closed, double spacing) {
  std::vector<double> at{0};
  for (std::size_t i = 0; i < closed.size(); ++i) {
    const cv::Point2d d = closed[(i + 1) % closed.size()] - closed[i];
    at.push_back(at.back() + std::hypot(d.x, d.y));
  }
  const int n = std::max(8, static_cast<int>(std::lround(at.back() / spacing)));
  std::vector<cv::Point2d> result;
  std::size_t i = 0;
  for (int k = 0; k < n; ++k) {
    const double s = at.back() * k / n;
    while (at[i + 1] < s) ++i;
    const double u = at[i + 1] > at[i] ? (s - at[i]) / (at[i + 1] - at[i]) : 0;
    result.push_back((1 - u) * closed[i] + u * closed[(i + 1) % closed.size()]);
  }
  return result;
}

std::vector<cv::Point2d> smoothed_ring(const std::vector<cv::Point2d>& ring, int half_window) {
  const int n = static_cast<int>(ring.size());
  std::vector<cv::Point2d> result(ring.size());
  for (int i = 0; i < n; ++i) {
    cv::Point2d sum(0, 0);
    for (int k = -half_window; k <= half_window; ++k) sum += ring[((i + k) % n + n) % n];
    result[i] = sum / (2 * half_window + 1);
  }
  return result;
}

/// A ring of boundary pixels moved onto the ½ level of the smoothed mask along its gradient.
std::vector<cv::Point2d> on_level(const std::vector<cv::Point>& ring, const cv::Mat& level) {
  std::vector<cv::Point2d> points;
  for (const cv::Point& start : ring) {
    cv::Point2d p = start;
    for (int round = 0; round < 3; ++round) {  // Newton's steps; the level is nearly linear there
      const cv::Point2d gradient(sample(level, p + cv::Point2d(0.5, 0)) - sample(level, p - cv::Point2d(0.5, 0)),
                                 sample(level, p + cv::Point2d(0, 0.5)) - sample(level, p - cv::Point2d(0, 0.5)));
      const double steepness = gradient.dot(gradient), excess = 0.5 - sample(level, p);
      if (steepness < 1e-4) break;
      cv::Point2d step = (excess / steepness) * gradient;
      const double l = std::hypot(step.x, step.y);
      p += l > 1 ? step / l : step;
    }
    points.push_back(p);
  }
  return points;
}

/// The rings around one part of a mask: the outer one first, then the holes in it, the largest first.
std::vector<std::vector<cv::Point2d>> rings_of(const cv::Mat& mask) {
  cv::Mat framed, level;
  constexpr int kFrame = 8;
  cv::copyMakeBorder(mask, framed, kFrame, kFrame, kFrame, kFrame, cv::BORDER_CONSTANT, 0);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(framed, contours, cv::RETR_CCOMP, cv::CHAIN_APPROX_NONE);
  std::stable_sort(contours.begin(), contours.end(),
                   [](const auto& a, const auto& b) { return cv::contourArea(a) > cv::contourArea(b); });
  framed.convertTo(level, CV_32F, 1.0 / 255);
  level = gaussian(level, kMaskSigma_px);
  std::vector<std::vector<cv::Point2d>> rings;
  for (const auto& contour : contours) {
    rings.push_back(smoothed_ring(on_level(contour, level), 2));
    for (cv::Point2d& p : rings.back()) p -= cv::Point2d(kFrame, kFrame);
  }
  return rings;
}

Scene scene_of(const cv::Mat& image, double pixel_size_um) {
  const cv::Mat padding = padding_in(image), full = without_padding(image, padding);
  Scene s{full, {}, pixel_size_um, pixel_size_um, 0, 0, {}};
  // the rings' last move is made in the full image, so that three pixels a micrometre do here
  const int factor = std::max(1, static_cast<int>(kGrid_um / pixel_size_um));
  s.pixel_um = pixel_size_um * factor;
  s.band_px = std::max(2.0, kBand_um / s.pixel_um);
  const cv::Mat small = shrink(full, factor);
  const double sigma_px = std::max(0.5, kSmoothing_um / s.pixel_um);
  s.smooth = gaussian(small, sigma_px);
  s.noise = overall_noise(small) * noise_gain(sigma_px);
  if (padding.empty()) return s;
  cv::Mat mask;
  padding.convertTo(mask, CV_32F);
  cv::distanceTransform(shrink(mask, factor) == 0, s.recorded_px, cv::DIST_L2, cv::DIST_MASK_PRECISE);
  return s;
}

/// As near to the image's padding as a ring comes that its edge has made.
bool is_at_padding(const Scene& s, Vec2 p) {
  return !s.recorded_px.empty() && sample(s.recorded_px, to_pixels(p, s.pixel_um)) * s.pixel_um <= s.border_um();
}

/// Points at the image's border and at adhesions stay: there the ring is not an edge of this channel. So do those in
/// haze, which has no profile of a membrane.
std::vector<bool> movable(const std::vector<Vec2>& ring_um, const std::vector<Adhesion>& adhesions, const Scene& s,
                          const cv::Mat& soft) {
  std::vector<bool> result;
  for (const Vec2 p : ring_um) {
    const double border = std::min({p.x, p.y, s.field_um().x - p.x, s.field_um().y - p.y});
    const int x = std::clamp(static_cast<int>(p.x / s.pixel_um), 0, soft.cols - 1);
    const int y = std::clamp(static_cast<int>(p.y / s.pixel_um), 0, soft.rows - 1);
    result.push_back(border > s.border_um() && !is_at_padding(s, p) && !soft.at<uchar>(y, x) &&
                     std::none_of(adhesions.begin(), adhesions.end(), [&](const Adhesion& a) {
                       return norm(a.position_um - p) < a.major_axis_um / 2 + 1 && distance_to_ellipse_um(a, p) < 0.3;
                     }));
  }
  return result;
}

/// A ring of the mask's grid as the polygon on the image's edge.
Polygon polygon_of(const Scene& s, const std::vector<cv::Point2d>& ring, const std::vector<Adhesion>& adhesions,
                   const cv::Mat& soft) {
  const auto points = resampled(ring, kOutlineSpacing_um / s.pixel_um);
  Polygon coarse, polygon;
  std::vector<cv::Point2d> full_ring;
  for (const cv::Point2d& point : points) {
    coarse.push_back(to_um(point, s.pixel_um));
    full_ring.push_back(to_pixels(coarse.back(), s.full_pixel_um));
  }
  const Vec2 field_um = s.field_um();
  const auto moved = on_edge(s.full, full_ring, movable(coarse, adhesions, s, soft), s.full_pixel_um);
  for (const cv::Point2d& point : resampled(smoothed_ring(moved, 1), kOutlineSpacing_um / s.full_pixel_um)) {
    const Vec2 at = to_um(point, s.full_pixel_um);
    polygon.push_back({std::clamp(at.x, 0.0, field_um.x), std::clamp(at.y, 0.0, field_um.y)});
  }
  return polygon;
}

/// A gap whose ring crosses the outline is a bay.
bool is_inside(const Polygon& hole, const Polygon& outer) {
  return std::all_of(hole.begin(), hole.end(), [&](Vec2 p) { return contains(outer, p); });
}

/// The cell that a part of the mask shows.
CellOutline outline_of(const Scene& s, const cv::Mat& part, const cv::Mat& holes,
                       const std::vector<Adhesion>& adhesions, const cv::Mat& soft) {
  CellOutline cell;
  for (const auto& ring : rings_of(part & ~holes)) {
    const Polygon polygon = polygon_of(s, ring, adhesions, soft);
    if (cell.outer_um.empty()) {
      CutRing cut = cut_by_border(polygon, s.field_um(), s.border_um());
      cell.outer_um = std::move(cut.points_um);
      cell.is_cut = std::move(cut.is_cut);
      const std::size_t n = cell.outer_um.size();
      for (std::size_t i = 0; i < n; ++i)
        if (is_at_padding(s, cell.outer_um[i]) && is_at_padding(s, cell.outer_um[(i + 1) % n])) cell.is_cut[i] = true;
      cell.area_um2 = std::abs(signed_area_um2(cell.outer_um));
    } else if (is_inside(polygon, cell.outer_um) && std::abs(signed_area_um2(polygon)) > 0) {
      cell.holes_um.push_back(polygon);
      cell.area_um2 -= std::abs(signed_area_um2(polygon));
    }
  }
  return cell;
}

/// Bright things away from all cells that are none themselves, the largest first.
std::vector<Polygon> debris_in(const Scene& s, const cv::Mat& bright, const cv::Mat& cells) {
  constexpr double kLeast_um2 = 1;
  constexpr std::size_t kMost = 100;  // in haze or noise there are any number
  cv::Mat near;
  cv::dilate(cells, near, disc_of(s.band_px));
  Parts parts = parts_of(bright & ~near, s.px_of(kLeast_um2));
  parts.parts.resize(std::min(parts.parts.size(), kMost));
  std::vector<Polygon> debris;
  for (const Parts::Part& part : parts.parts) {
    Polygon& polygon = debris.emplace_back();
    const auto rings = rings_of(parts.labels(part.box) == part.label);
    for (const cv::Point2d& p : rings.front()) polygon.push_back(to_um(p + cv::Point2d(part.box.tl()), s.pixel_um));
  }
  return debris;
}

/// Of the necks at which a mask was cut the narrowest at this part of it.
std::optional<OutlineNeck> narrowest_neck(const std::vector<Neck>& necks, const cv::Mat& part, double pixel_um) {
  const cv::Rect frame({0, 0}, part.size());
  std::optional<OutlineNeck> narrowest;
  for (const Neck& neck : necks) {
    constexpr int kBeside_px = 2;  // its own pixel was taken out, or is the other part's
    const cv::Rect near(neck.at - cv::Point(kBeside_px, kBeside_px), cv::Size(2 * kBeside_px + 1, 2 * kBeside_px + 1));
    const double width_um = neck.width_px * pixel_um;
    if (cv::countNonZero(part(near & frame)) == 0 || (narrowest && narrowest->width_um <= width_um)) continue;
    narrowest = {to_um(neck.at, pixel_um), width_um};
  }
  return narrowest;
}

/// The cells in what stands out, and their mask.
std::pair<CellsInImage, cv::Mat> cells_of(const Scene& s, cv::Mat bright, const std::vector<Adhesion>& adhesions,
                                          const OutlineParameters& p) {
  const double smallest = s.px_of(p.outline_smallest_um2);
  auto [mask, soft] = cells_in(s, bright, smallest);
  if (!mask.empty() && !s.recorded_px.empty()) {
    mask &= s.recorded_px > 0;
    bright &= s.recorded_px > 0;
  }
  if (mask.empty() || cv::countNonZero(mask) == 0) return {};
  const cv::Mat seen = mask.clone();
  const cv::Mat holes = holes_in(s.smooth, mask, s.band_px, s.noise, s.px_of(p.outline_smallest_hole_um2));
  CellsInImage found;
  found.debris_um = debris_in(s, bright, mask);
  found.beyond_um = add_adhesions(mask, adhesions, s.pixel_um, p.outline_reach_um);
  const Parts parts = parts_of(filled(mask), smallest);
  for (const Parts::Part& each : parts.parts) {
    const cv::Mat part = parts.mask(each);
    if (each.n_pixels > s.px_of(p.outline_largest_um2)) {
      found.cells.push_back(outline_of(s, part, cv::Mat::zeros(part.size(), CV_8U), adhesions, soft));
      found.cells.back().is_sheet = true;
      continue;
    }
    const CutMask cut = cut_at_necks(part, p.outline_neck, smallest);
    cv::Mat unseen;  // the cell's edge is not to be seen where another one touches it
    cv::dilate(cut.cuts, unseen, disc_of(s.band_px / 2));
    const Parts apart = parts_of(cut.mask, smallest);
    for (const Parts::Part& one : apart.parts) {
      const cv::Mat cell = apart.mask(one);
      found.cells.push_back(outline_of(s, cell, holes, adhesions, soft | unseen));
      found.cells.back().neck = narrowest_neck(cut.necks, cell, s.pixel_um);
    }
  }
  std::ranges::stable_sort(found.cells, std::greater(), &CellOutline::area_um2);
  return {std::move(found), seen};
}

}  // namespace

void declare(stage::ParameterList& list, OutlineParameters& p) {
  list.table("segment");
  list.add("outline_reach_um", p.outline_reach_um, Range::zero_or_size_um());
  list.add("outline_smallest_um2", p.outline_smallest_um2, Range::area_um2());
  list.add("outline_largest_um2", p.outline_largest_um2, Range::area_um2());
  list.add("outline_smallest_hole_um2", p.outline_smallest_hole_um2, Range::area_um2());
  list.add("outline_neck", p.outline_neck, Range::between(0.0, 1.0));
}

CellsInImage find_cells(const images::Image& image, const std::vector<Adhesion>& adhesions, double pixel_size_um,
                        const OutlineParameters& p) {
  constexpr double kHeld = 0.02;  // of the adhesions may lie outside: a speck or two
  const Scene s = scene_of(matrix_of(image), pixel_size_um);
  auto [first, mask] = cells_of(s, first_mask(s.smooth, s.noise), adhesions, p);
  if (reach_um(first, adhesions) <= kOutlineReach_um) return first;
  CellsInImage second = cells_of(s, first_mask(s.smooth, s.noise, mask) & mask, adhesions, p).first;
  const bool is_better =
      reach_um(second, adhesions) <= kOutlineReach_um && share_beyond_cells(second, adhesions).value_or(1) <= kHeld;
  return is_better ? second : first;
}

}  // namespace mbtfm::cells
