#include "segment/beads/picture.h"

#include <algorithm>
#include <opencv2/imgproc.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::beads {

namespace {

constexpr double kLongSide_px = 1000;  // a page shows it 700 px wide
constexpr double kBrightest = 0.998;   // beads cover some per cent of an image

cv::Mat stretched(const images::Image& image, const cv::Rect& part, cv::Size size) {
  const cv::Mat whole(image.height, image.width, CV_32F, const_cast<float*>(image.pixels.data()));
  cv::Mat values;
  cv::resize(whole(part), values, size, 0, 0, cv::INTER_AREA);
  const std::vector<float> all(values.begin<float>(), values.end<float>());
  const double low = numerics::quantile(all, 0.5), high = numerics::quantile(all, kBrightest);
  return cv::min(cv::max((values - low) / std::max(high - low, 1e-12), 0.0), 1.0);
}

}  // namespace

images::Picture picture_of_beads(const images::Image& relaxed, const images::Image& stressed, Vec2 drift_px) {
  if (relaxed.width != stressed.width || relaxed.height != stressed.height)
    throw InvalidData("the bead images", "two of one size", "two sizes");
  const cv::Rect all(0, 0, relaxed.width, relaxed.height);
  const cv::Point shift(cvRound(drift_px.x), cvRound(drift_px.y));
  const cv::Rect common = all & (all - shift);
  const double reduction = std::max(1.0, std::max(all.width, all.height) / kLongSide_px);
  images::Picture picture;
  picture.width = std::max(1, cvFloor(all.width / reduction));
  picture.height = std::max(1, cvFloor(all.height / reduction));
  picture.rgb.assign(3 * static_cast<std::size_t>(picture.width) * static_cast<std::size_t>(picture.height), 0);
  cv::Mat rgb(picture.height, picture.width, CV_8UC3, picture.rgb.data());
  const cv::Rect place =
      cv::Rect(cvRound(common.x / reduction), cvRound(common.y / reduction),
               std::max(1, cvFloor(common.width / reduction)), std::max(1, cvFloor(common.height / reduction))) &
      cv::Rect(0, 0, picture.width, picture.height);
  if (common.empty() || place.empty()) return picture;
  const cv::Mat green = 255 * stretched(relaxed, common, place.size());
  const cv::Mat purple = 255 * stretched(stressed, common + shift, place.size());
  cv::Mat both;
  cv::merge(std::vector<cv::Mat>{purple, green, purple}, both);
  both.convertTo(rgb(place), CV_8UC3);
  return picture;
}

}  // namespace mbtfm::beads
