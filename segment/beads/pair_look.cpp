#include "segment/beads/pair_look.h"

#include <algorithm>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "segment/beads/coarse_field.h"

namespace mbtfm::beads {

namespace {

cv::Mat small_picture(const images::Image& image, int binning) {
  constexpr double kWide_px = 8;  // wider than any bead
  Plane plane = compressed(without_background(images::binned(image, binning), kWide_px));
  return cv::Mat(plane.height, plane.width, CV_32F, plane.values.data()).clone();
}

struct Orientation {
  const char* name;
  int quarter_turns;
  bool is_mirrored;
};
constexpr Orientation kOthers[] = {{"turned by 90 degrees", 1, false},
                                   {"turned by 180 degrees", 2, false},
                                   {"turned by -90 degrees", 3, false},
                                   {"mirrored", 0, true},
                                   {"mirrored and turned by 90 degrees", 1, true},
                                   {"mirrored and turned by 180 degrees", 2, true},
                                   {"mirrored and turned by -90 degrees", 3, true}};

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
  for (const Orientation& other : kOthers) {
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

}  // namespace mbtfm::beads
