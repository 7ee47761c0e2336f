#include "segment/beads/picture.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>
#include <tuple>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::beads {
namespace {

constexpr double kLongSide_px = 1000;  // a page shows it 700 px wide
constexpr double kBrightest = 0.998;   // beads cover some per cent of an image

cv::Mat matrix_of(const images::Image& image) {
  return {image.height, image.width, CV_32F, const_cast<float*>(image.pixels.data())};
}

/// A picture in another's frame, and where it shows something.
using Moved = std::tuple<cv::Mat, cv::Mat>;

/// @param flags  WARP_INVERSE_MAP: the placement leads from the result to the image
Moved moved(const cv::Mat& image, const Placement& placement, int flags) {
  const Vec2 zero = placement.of({0, 0}), x = placement.of({1, 0}) - zero, y = placement.of({0, 1}) - zero;
  const cv::Matx23d matrix(x.x, y.x, zero.x, x.y, y.y, zero.y);
  const cv::Mat whole(image.size(), CV_8U, cv::Scalar(255));
  cv::Mat values, is_seen;
  cv::warpAffine(image, values, matrix, image.size(), flags | cv::INTER_CUBIC, cv::BORDER_REPLICATE);
  cv::warpAffine(whole, is_seen, matrix, image.size(), flags | cv::INTER_NEAREST);
  return {values, is_seen};
}

cv::Mat stretched(const cv::Mat& image, const cv::Mat& is_seen, cv::Size size) {
  cv::Mat values;
  cv::resize(image, values, size, 0, 0, cv::INTER_AREA);
  std::vector<double> seen;
  for (int j = 0; j < size.height; ++j) {
    for (int i = 0; i < size.width; ++i) {
      if (is_seen.at<unsigned char>(j, i) != 0) seen.push_back(values.at<float>(j, i));
    }
  }
  const double low = numerics::quantile(seen, 0.5), high = numerics::quantile(seen, kBrightest);
  cv::Mat light = cv::min(cv::max((values - low) / std::max(high - low, 1e-12), 0.0), 1.0);
  light.setTo(0, is_seen == 0);
  return 255 * light;
}

}  // namespace

images::Picture picture_of_beads(const images::Image& relaxed, const images::Image& stressed,
                                 const Placement& placement, CellWith cell_with) {
  if (relaxed.width != stressed.width || relaxed.height != stressed.height)
    throw InvalidData("the bead images", "two of one size", "two sizes");
  cv::Mat at_rest = matrix_of(relaxed), pulled = matrix_of(stressed), is_seen;
  if (cell_with == CellWith::relaxed) {
    std::tie(pulled, is_seen) = moved(pulled, placement, cv::WARP_INVERSE_MAP);
  } else {
    std::tie(at_rest, is_seen) = moved(at_rest, placement, 0);
  }
  const double reduction = std::max(1.0, std::max(relaxed.width, relaxed.height) / kLongSide_px);
  images::Picture picture;
  picture.width = std::max(1, cvFloor(relaxed.width / reduction));
  picture.height = std::max(1, cvFloor(relaxed.height / reduction));
  picture.rgb.assign(3 * static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height), 0);
  cv::Mat rgb(picture.height, picture.width, CV_8UC3, picture.rgb.data());
  cv::resize(is_seen, is_seen, rgb.size(), 0, 0, cv::INTER_NEAREST);
  if (cv::countNonZero(is_seen) == 0) return picture;
  const cv::Mat green = stretched(at_rest, is_seen, rgb.size()), purple = stretched(pulled, is_seen, rgb.size());
  cv::Mat both;
  cv::merge(std::vector<cv::Mat>{purple, green, purple}, both);
  both.convertTo(rgb, CV_8UC3);
  return picture;
}

}  // namespace mbtfm::beads
