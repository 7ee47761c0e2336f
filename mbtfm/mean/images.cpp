#include "mbtfm/mean/images.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "pipeline/numerics/dense.h"

namespace mbtfm::mean {
namespace {

constexpr int kImageAngles = 120;
constexpr int kCoarse_px = 160;  // of the longer side while angles are tried: 3 degrees are then four pixels at the rim
constexpr int kFine_px = 800;    // of the longer side at last: more fixes the place no better than the outline is drawn
constexpr int kWays = 4;         // that are refined

struct Raster {
  cv::Mat values;  ///< of mean 0
  double pixel_um = 0;
  Vec2 size_um() const { return {values.cols * pixel_um, values.rows * pixel_um}; }
};

Raster raster_of(const Brightness& image, double pixel_um) {
  const cv::Mat whole(image.height, image.width, CV_32F, const_cast<float*>(image.values.data()));
  const double share = image.pixel_size_um / pixel_um;
  Raster raster{.values = {}, .pixel_um = pixel_um};
  const cv::Size size(std::max(8, static_cast<int>(std::lround(image.width * share))),
                      std::max(8, static_cast<int>(std::lround(image.height * share))));
  cv::resize(whole, raster.values, size, 0, 0, share < 1 ? cv::INTER_AREA : cv::INTER_LINEAR);
  cv::GaussianBlur(raster.values, raster.values, {}, 1.0);  // so that its slopes are those of what is seen
  raster.values -= cv::mean(raster.values)[0];
  return raster;
}

/// The image in the frame of the reference; `seen` is 1 where it reaches.
struct Laid {
  cv::Mat values, seen;
};
Laid laid(const Raster& image, const Raster& reference, const Motion& motion) {
  // centres of pixels: (i + 1/2) p
  const auto from = [&](double i, double j) {
    const Vec2 there = motion.back_um({(i + 0.5) * reference.pixel_um, (j + 0.5) * reference.pixel_um});
    return Vec2{there.x / image.pixel_um - 0.5, there.y / image.pixel_um - 0.5};
  };
  const Vec2 origin = from(0, 0), x = from(1, 0) - origin, y = from(0, 1) - origin;
  const cv::Matx23d affine(x.x, y.x, origin.x, x.y, y.y, origin.y);
  Laid result;
  const cv::Size size = reference.values.size();
  const cv::Mat ones = cv::Mat::ones(image.values.size(), CV_32F);
  cv::warpAffine(image.values, result.values, affine, size, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
  cv::warpAffine(ones, result.seen, affine, size, cv::INTER_LINEAR | cv::WARP_INVERSE_MAP);
  return result;
}

/// Where on the reference a laid image correlates best, as a further shift.
struct Peak {
  Vec2 shift_um;
  double height = 0;
};
Peak best_shift(const cv::Mat& laid_image, const Raster& reference) {
  const int n = cv::getOptimalDFTSize(2 * std::max(reference.values.cols, reference.values.rows));
  const auto waves = [&](const cv::Mat& image) {
    cv::Mat padded = cv::Mat::zeros(n, n, CV_32F), transformed;
    image.copyTo(padded(cv::Rect(0, 0, image.cols, image.rows)));
    cv::dft(padded, transformed);
    return transformed;
  };
  cv::Mat product, correlation;
  cv::mulSpectrums(waves(reference.values), waves(laid_image), product, 0, true);
  cv::idft(product, correlation, cv::DFT_SCALE);
  double height = 0;
  cv::Point at;
  cv::minMaxLoc(correlation, nullptr, &height, nullptr, &at);
  const auto signed_shift = [&](int k) { return reference.pixel_um * (k > n / 2 ? k - n : k); };
  return {{signed_shift(at.x), signed_shift(at.y)}, height / (cv::norm(laid_image) * cv::norm(reference.values))};
}

/// A step of Gauss and Newton towards the least |a image + b - reference|².
struct Step {
  Eigen::Matrix<double, 5, 5> matrix = Eigen::Matrix<double, 5, 5>::Zero();  ///< shift x, y, turn, gain, offset
  Eigen::Matrix<double, 5, 1> slope = Eigen::Matrix<double, 5, 1>::Zero();
  double correlation = 0, residual2 = 0, n = 0;
};
Step step_at(const Laid& image, const Raster& reference, Vec2 centre_um) {
  cv::Mat by_x, by_y;
  cv::Sobel(image.values, by_x, CV_32F, 1, 0, 3, 1 / (8 * reference.pixel_um));
  cv::Sobel(image.values, by_y, CV_32F, 0, 1, 3, 1 / (8 * reference.pixel_um));
  const auto for_each = [&](const auto& body) {
    for (int j = 1; j + 1 < image.values.rows; ++j) {
      for (int i = 1; i + 1 < image.values.cols; ++i)
        if (image.seen.at<float>(j, i) > 0.999F)
          body(j, i, image.values.at<float>(j, i), reference.values.at<float>(j, i));
    }
  };
  Step step;
  double w = 0, r = 0, ww = 0, rr = 0, wr = 0;
  for_each([&](int, int, double a, double b) {
    step.n += 1;
    w += a, r += b, ww += a * a, rr += b * b, wr += a * b;
  });
  if (step.n < 16) return step;
  const double n = step.n, cov = wr / n - w * r / (n * n), var_w = ww / n - w * w / (n * n);
  const double var_r = rr / n - r * r / (n * n);
  if (!(var_w > 0 && var_r > 0)) return step;
  step.correlation = cov / std::sqrt(var_w * var_r);
  const double gain = cov / var_w, offset = r / n - gain * w / n;
  for_each([&](int j, int i, double a, double b) {
    const double gx = gain * by_x.at<float>(j, i), gy = gain * by_y.at<float>(j, i);
    const Vec2 arm = Vec2{(i + 0.5) * reference.pixel_um, (j + 0.5) * reference.pixel_um} - centre_um;
    Eigen::Matrix<double, 5, 1> by;
    by << -gx, -gy, gx * arm.y - gy * arm.x, a, 1;
    const double left = gain * a + offset - b;
    step.residual2 += left * left;
    step.matrix += by * by.transpose();
    step.slope += left * by;
  });
  return step;
}

Way refined(const Raster& image, const Raster& reference, Motion motion) {
  constexpr int kMostSteps = 40;
  constexpr double kStill = 1e-3;  // pixels
  Step now = step_at(laid(image, reference, motion), reference, motion.to_um);
  for (int k = 0; k < kMostSteps && now.residual2 > 0; ++k) {
    const Eigen::Matrix<double, 5, 1> change = -numerics::solve_symmetric(now.matrix, now.slope);
    double length = 1;
    bool is_better = false;
    for (; length > 0.05 && !is_better; length /= 2) {
      Motion next = motion;
      next.to_um += {length * change[0], length * change[1]};
      next.angle_rad += length * change[2];
      const Step there = step_at(laid(image, reference, next), reference, next.to_um);
      if (!(there.correlation > now.correlation)) continue;
      is_better = true;
      motion = next;
      now = there;
    }
    const double moved = std::hypot(change[0], change[1]) + std::abs(change[2]) * 0.5 * norm(reference.size_um());
    if (!is_better || moved < kStill * reference.pixel_um) break;
  }
  motion.angle_rad = std::remainder(motion.angle_rad, 2 * std::numbers::pi);
  Way way{.motion = motion, .correlation = now.correlation};
  if (!(now.residual2 > 0)) return way;
  constexpr double kBlur = 16;  // pixels that share their noise after the blur: 4 pi s² and the interpolation's
  const Eigen::Matrix<double, 5, 5> covariance = kBlur * now.residual2 / now.n * now.matrix.inverse();
  way.shift_error_um = std::sqrt(0.5 * (covariance(0, 0) + covariance(1, 1)));
  way.angle_error_rad = std::sqrt(covariance(2, 2));
  return way;
}

}  // namespace

std::vector<Way> ways_by_images(const Brightness& image, const Brightness& reference, Mirrors mirrors) {
  const auto pixel = [&](int most_px) {
    const double longer = std::max(reference.width, reference.height) * reference.pixel_size_um;
    return std::max(reference.pixel_size_um, longer / most_px);
  };
  const Raster coarse = raster_of(image, pixel(kCoarse_px)), coarse_reference = raster_of(reference, pixel(kCoarse_px));
  struct Start {
    Motion motion;
    double height;
  };
  std::vector<Start> starts;
  for (const bool is_mirrored : {false, true}) {
    if (is_mirrored && mirrors == Mirrors::not_tried) continue;
    std::vector<Start> around;
    for (int k = 0; k < kImageAngles; ++k) {
      Motion motion{0.5 * coarse.size_um(), 0.5 * coarse_reference.size_um(), 2 * std::numbers::pi * k / kImageAngles,
                    is_mirrored};
      const Peak peak = best_shift(laid(coarse, coarse_reference, motion).values, coarse_reference);
      motion.to_um += peak.shift_um;
      around.push_back({motion, peak.height});
    }
    for (int k = 0; k < kImageAngles; ++k) {
      const double before = around[(k + kImageAngles - 1) % kImageAngles].height,
                   after = around[(k + 1) % kImageAngles].height;
      if (around[k].height > before && around[k].height >= after) starts.push_back(around[k]);
    }
  }
  std::ranges::stable_sort(starts, std::greater(), &Start::height);
  if (starts.size() > kWays) starts.resize(kWays);
  const Raster fine = raster_of(image, pixel(kFine_px)), fine_reference = raster_of(reference, pixel(kFine_px));
  std::vector<Way> ways;
  for (const Start& start : starts)
    ways.push_back(refined(fine, fine_reference, refined(coarse, coarse_reference, start.motion).motion));
  std::ranges::stable_sort(ways, std::greater(), &Way::correlation);
  return ways;
}

bool correlate_equally(const Way& a, const Way& b) {
  constexpr double kTenth = 1.1, kSeen = 1e-3;
  const auto unexplained = [](const Way& way) { return std::sqrt(std::max(kSeen * kSeen, 1 - way.correlation)); };
  return unexplained(b) < kTenth * unexplained(a);
}

}  // namespace mbtfm::mean
