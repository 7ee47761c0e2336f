#include "segment/beads/pair_look.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "segment/beads/coarse_field.h"
#include "segment/beads/given_field.h"

namespace mbtfm::beads {
namespace {

cv::Mat small_picture(const images::Image& image, int binning) {
  constexpr double kWide_px = 8;  // wider than any bead
  Plane plane = compressed(without_background(images::binned(image, binning), kWide_px));
  return cv::Mat(plane.height, plane.width, CV_32F, plane.values.data()).clone();
}

cv::Mat oriented(const cv::Mat& picture, const Orientation& as) {
  cv::Mat flipped, turned;
  if (as.is_mirrored) cv::flip(picture, flipped, 1);
  const cv::Mat& mirrored = as.is_mirrored ? flipped : picture;
  constexpr int kTurns[] = {-1, cv::ROTATE_90_CLOCKWISE, cv::ROTATE_180, cv::ROTATE_90_COUNTERCLOCKWISE};
  if (as.quarter_turns == 0) return mirrored;
  cv::rotate(mirrored, turned, kTurns[as.quarter_turns]);
  return turned;
}

}  // namespace

PairLook look_at_pair(const images::Image& relaxed, const images::Image& stressed) {
  constexpr int kSide_px = 500;
  constexpr double kHigher = 3;
  const int binning = std::clamp(std::min(relaxed.width, relaxed.height) / kSide_px, 1, images::kLargestBinning);
  const cv::Mat from = small_picture(relaxed, binning), to = small_picture(stressed, binning);
  cv::Mat window;
  cv::createHanningWindow(window, from.size(), CV_32F);
  double height = 0;
  const cv::Point2d shift = cv::phaseCorrelate(from, to, window, &height);
  PairLook look{.shift_px = binning * Vec2{shift.x, shift.y}, .orientation = {}};
  double highest = kHigher * height;
  for (const Orientation& other : kOtherOrientations) {
    const cv::Mat turned = oriented(to, other);
    if (turned.size() != from.size()) continue;
    double of_other = 0;
    cv::phaseCorrelate(from, turned, window, &of_other);
    if (of_other <= highest) continue;
    highest = of_other;
    look.orientation = other.name;
  }
  return look;
}

namespace {

Vec2 oriented(Vec2 v, const Orientation& as) {
  if (as.is_mirrored) v.x = -v.x;
  for (int k = 0; k < as.quarter_turns; ++k) v = {-v.y, v.x};
  return v;
}

/// Between the lengths of the displacements and the picture's brightness at their places.
double correlation(const DisplacementField& field, const images::Image& picture, double pixel_um,
                   const Orientation& as) {
  const Vec2 middle = 0.5 * pixel_um * Vec2{double(picture.width), double(picture.height)};
  double n = 0, sum_u = 0, sum_b = 0, uu = 0, bb = 0, ub = 0;
  for (const Bead& bead : field) {
    const Vec2 at = 1 / pixel_um * (middle + oriented(bead.position_um - middle, as));
    if (!bead.flag.empty() || !(at.x >= 0 && at.y >= 0 && at.x < picture.width && at.y < picture.height)) continue;
    const double u = norm(bead.displacement_um), b = picture.at(static_cast<int>(at.x), static_cast<int>(at.y));
    n += 1, sum_u += u, sum_b += b, uu += u * u, bb += b * b, ub += u * b;
  }
  const double spread = (n * uu - sum_u * sum_u) * (n * bb - sum_b * sum_b);
  return spread > 0 ? (n * ub - sum_u * sum_b) / std::sqrt(spread) : 0;
}

}  // namespace

FieldLook look_at_field(const DisplacementField& field, const images::Image& cell, double pixel_um) {
  constexpr double kCoarse_um = 2, kNearer = 0.2, kInward = -0.4, kNotInward = -0.2;
  const int binning = std::clamp(static_cast<int>(kCoarse_um / pixel_um), 1, std::min(cell.width, cell.height));
  const images::Image coarse = images::binned(cell, binning);
  FieldLook look;
  double nearest = correlation(field, coarse, binning * pixel_um, {}) + kNearer, inward = kInward;
  const bool points_inward = outwardness(field) < kNotInward;
  for (const Orientation& other : kOtherOrientations) {
    const double near = correlation(field, coarse, binning * pixel_um, other);
    if (near > nearest) {
      nearest = near;
      look.places = other.name;
    }
    DisplacementField turned = field;
    for (Bead& bead : turned) bead.displacement_um = oriented(bead.displacement_um, other);
    if (const double of_turned = outwardness(turned); !points_inward && of_turned < inward) {
      inward = of_turned;
      look.vectors = other.name;
    }
  }
  return look;
}

}  // namespace mbtfm::beads
