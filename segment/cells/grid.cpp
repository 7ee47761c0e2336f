#include "segment/cells/grid.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::cells {
namespace {

/// The grid on which slow local statistics are evaluated: a disc's radius is four of its cells (49 cells in the disc,
/// whose median errs by a sixth of their spread).
constexpr int kCellsInRadius = 4;

int factor_for(double radius_px) { return std::max(1, static_cast<int>(radius_px / kCellsInRadius)); }

std::vector<cv::Point> disc(int radius) {
  std::vector<cv::Point> offsets;
  for (int y = -radius; y <= radius; ++y)
    for (int x = -radius; x <= radius; ++x)
      if (x * x + y * y <= radius * radius) offsets.emplace_back(x, y);
  return offsets;
}

cv::Mat disc_median(const cv::Mat& image, int radius) {
  cv::Mat padded, result(image.size(), CV_32F);
  cv::copyMakeBorder(image, padded, radius, radius, radius, radius, cv::BORDER_REFLECT);
  const auto offsets = disc(radius);
  cv::parallel_for_(cv::Range(0, image.rows), [&](const cv::Range& rows) {
    std::vector<float> window(offsets.size());
    for (int y = rows.start; y < rows.end; ++y)
      for (int x = 0; x < image.cols; ++x) {
        for (std::size_t k = 0; k < offsets.size(); ++k)
          window[k] = padded.at<float>(y + radius + offsets[k].y, x + radius + offsets[k].x);
        result.at<float>(y, x) = numerics::median_in(window);
      }
  });
  return result;
}

cv::Mat enlarge(const cv::Mat& coarse, int factor, cv::Size size) {
  cv::Mat fine;
  cv::resize(coarse, fine, cv::Size(coarse.cols * factor, coarse.rows * factor), 0, 0, cv::INTER_LINEAR);
  return fine(cv::Rect(cv::Point(0, 0), size)).clone();
}

/// One pixel of each block: keeps the spread of single pixels, which a mean would lower.
cv::Mat pick(const cv::Mat& image, int factor) {
  cv::Mat result((image.rows + factor - 1) / factor, (image.cols + factor - 1) / factor, CV_32F);
  for (int y = 0; y < result.rows; ++y)
    for (int x = 0; x < result.cols; ++x)
      result.at<float>(y, x) = image.at<float>(std::min(y * factor + factor / 2, image.rows - 1),
                                               std::min(x * factor + factor / 2, image.cols - 1));
  return result;
}

}  // namespace

cv::Mat matrix_of(const images::Image& image) {
  if (image.width < 1 || image.height < 1 ||
      image.pixels.size() != static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height))
    throw InvalidData("image", "width × height pixels, at least one", std::to_string(image.pixels.size()) + " pixels");
  for (const float value : image.pixels)
    if (!std::isfinite(value)) throw InvalidData("image", "finite grey values", std::to_string(value));
  return cv::Mat(image.height, image.width, CV_32F, const_cast<float*>(image.pixels.data()));
}

cv::Mat shrink(const cv::Mat& image, int factor) {
  if (factor <= 1) return image;
  cv::Mat padded, result;
  const int right = (factor - image.cols % factor) % factor, bottom = (factor - image.rows % factor) % factor;
  cv::copyMakeBorder(image, padded, 0, bottom, 0, right, cv::BORDER_REPLICATE);
  cv::resize(padded, result, cv::Size(padded.cols / factor, padded.rows / factor), 0, 0, cv::INTER_AREA);
  return result;
}

cv::Mat gaussian(const cv::Mat& image, double sigma_px) {
  cv::Mat result;
  const int size = 2 * static_cast<int>(std::ceil(4 * sigma_px)) + 1;
  cv::GaussianBlur(image, result, cv::Size(size, size), sigma_px, sigma_px, cv::BORDER_REFLECT);
  return result;
}

cv::Mat wide_gaussian(const cv::Mat& image, double sigma_px) {
  constexpr double kSigmaOnGrid = 2.5;  // cells of the grid: linear interpolation between them then errs by 1 %
  const int factor = std::max(1, static_cast<int>(sigma_px / kSigmaOnGrid));
  return enlarge(gaussian(shrink(image, factor), sigma_px / factor), factor, image.size());
}

double noise_gain(double sigma_px) {
  const cv::Mat kernel = cv::getGaussianKernel(2 * static_cast<int>(std::ceil(4 * sigma_px)) + 1, sigma_px, CV_64F);
  return kernel.dot(kernel);  // of one direction; the root of its square for both
}

cv::Mat local_median(const cv::Mat& image, double radius_px) {
  const int factor = factor_for(radius_px);
  const int radius = std::max(1, static_cast<int>(std::lround(radius_px / factor)));
  return enlarge(disc_median(shrink(image, factor), radius), factor, image.size());
}

cv::Mat noise_magnitude(const cv::Mat& image) {
  const cv::Mat kernel = (cv::Mat_<float>(3, 3) << 1, -2, 1, -2, 4, -2, 1, -2, 1) / 6;
  cv::Mat differences;
  cv::filter2D(image, differences, CV_32F, kernel, cv::Point(-1, -1), 0, cv::BORDER_REFLECT);
  return cv::abs(differences);
}

cv::Mat local_noise(const cv::Mat& image, double radius_px) {
  // the mean magnitude of a normal variate is sqrt(2/pi) standard deviations
  return local_median(noise_magnitude(image), radius_px) * std::sqrt(std::numbers::pi / 2);
}

double overall_noise(const cv::Mat& image) { return 1.4826 * quantile(noise_magnitude(image), 0.5); }

cv::Mat local_range(const cv::Mat& image, double radius_px) {
  const int factor = factor_for(radius_px);
  const int radius = std::max(1, static_cast<int>(std::lround(radius_px / factor)));
  const cv::Mat square = cv::getStructuringElement(cv::MORPH_RECT, cv::Size(2 * radius + 1, 2 * radius + 1));
  cv::Mat least, greatest;
  const cv::Mat coarse = shrink(image, factor);
  cv::erode(coarse, least, square);
  cv::dilate(coarse, greatest, square);
  return enlarge(greatest - least, factor, image.size());
}

cv::Mat local_spread(const cv::Mat& residual, double radius_px) {
  const int factor = factor_for(radius_px);
  const int radius = std::max(1, static_cast<int>(std::lround(radius_px / factor)));
  return enlarge(disc_median(pick(cv::abs(residual), factor), radius), factor, residual.size()) * 1.4826;
}

float quantile(const cv::Mat& values, double q) {
  std::vector<float> sorted;
  sorted.reserve(values.total());
  for (int y = 0; y < values.rows; ++y)
    sorted.insert(sorted.end(), values.ptr<float>(y), values.ptr<float>(y) + values.cols);
  return numerics::quantile(std::move(sorted), q);
}

double median_within(const cv::Mat& values, const cv::Mat& mask) {
  std::vector<float> within;
  for (int y = 0; y < mask.rows; ++y)
    for (int x = 0; x < mask.cols; ++x)
      if (mask.at<uchar>(y, x)) within.push_back(values.at<float>(y, x));
  return within.empty() ? 0 : quantile(cv::Mat(within), 0.5);
}

cv::Mat filled(const cv::Mat& mask) {
  // what cannot be reached from a frame around the image is in the mask or in a hole of it
  cv::Mat framed;
  cv::copyMakeBorder(mask, framed, 1, 1, 1, 1, cv::BORDER_CONSTANT, 0);
  cv::floodFill(framed, cv::Point(0, 0), 128);
  return framed(cv::Rect(1, 1, mask.cols, mask.rows)) != 128;
}

cv::Mat disc_of(double radius_px) {
  const int r = std::max(1, static_cast<int>(std::lround(radius_px)));
  return cv::getStructuringElement(cv::MORPH_ELLIPSE, cv::Size(2 * r + 1, 2 * r + 1));
}

float sample(const cv::Mat& image, cv::Point2d point) {
  const double x = std::clamp(point.x, 0.0, image.cols - 1.0), y = std::clamp(point.y, 0.0, image.rows - 1.0);
  const int i = std::min(static_cast<int>(x), std::max(0, image.cols - 2));
  const int j = std::min(static_cast<int>(y), std::max(0, image.rows - 2));
  const int i1 = std::min(i + 1, image.cols - 1), j1 = std::min(j + 1, image.rows - 1);
  const double u = x - i, v = y - j;
  return static_cast<float>((1 - v) * ((1 - u) * image.at<float>(j, i) + u * image.at<float>(j, i1)) +
                            v * ((1 - u) * image.at<float>(j1, i) + u * image.at<float>(j1, i1)));
}

}  // namespace mbtfm::cells
