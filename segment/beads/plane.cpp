#include "segment/beads/plane.h"

#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "pipeline/numerics/order_statistics.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::beads {
namespace {

cv::Mat as_mat(const std::vector<float>& values, int width, int height) {
  return {height, width, CV_32F, const_cast<float*>(values.data())};
}

std::vector<float> blurred_values(const std::vector<float>& values, int width, int height, double sigma) {
  std::vector<float> result(values.size());
  cv::Mat out = as_mat(result, width, height);
  const int reach = 2 * static_cast<int>(std::ceil(3.5 * sigma)) + 1;  // beyond 3.5 sigma lies 5e-4 of the weight
  cv::GaussianBlur(as_mat(values, width, height), out, {reach, reach}, sigma, sigma, cv::BORDER_REFLECT_101);
  return result;
}

/// The same for a wide Gaussian, on a picture a quarter the size: what is left has no detail that this would lose.
std::vector<float> widely_blurred_values(const std::vector<float>& values, int width, int height, double sigma) {
  constexpr int kFactor = 4;
  if (width < 8 * kFactor || height < 8 * kFactor || sigma < 2 * kFactor) {
    return blurred_values(values, width, height, sigma);
  }
  cv::Mat small;
  cv::resize(as_mat(values, width, height), small, {}, 1.0 / kFactor, 1.0 / kFactor, cv::INTER_AREA);
  cv::GaussianBlur(small, small, {}, sigma / kFactor, sigma / kFactor, cv::BORDER_REFLECT_101);
  std::vector<float> result(values.size());
  cv::Mat out = as_mat(result, width, height);
  cv::resize(small, out, {width, height}, 0, 0, cv::INTER_LINEAR);
  return result;
}

/// Mean product of the tile's values (mean removed) with those `di`, `dj` further on.
double autocorrelation(const Plane& plane, int left, int top, int side, int di, int dj, double mean) {
  double sum = 0;
  for (int j = top; j < top + side; ++j) {
    for (int i = left; i < left + side; ++i) sum += (plane.at(i, j) - mean) * (plane.at(i + di, j + dj) - mean);
  }
  return sum / (side * side);
}

/// For Gaussian spots of sigma s the autocorrelation is exp(−r²/4s²): s² = (r2² − r1²) / (4 ln(C1/C2)).
double sigma_of_tile(const Plane& plane, int left, int top, int side) {
  double mean = 0;
  for (int j = top; j < top + side; ++j) {
    for (int i = left; i < left + side; ++i) mean += plane.at(i, j);
  }
  mean /= side * side;
  const auto c = [&](int di, int dj) { return autocorrelation(plane, left, top, side, di, dj, mean); };
  const double at_zero = c(0, 0);
  const double near = 0.5 * (c(1, 0) + c(0, 1));
  const double far = 0.5 * (c(2, 0) + c(0, 2));
  if (!(near > 0.05 * at_zero) || !(far > 0.02 * at_zero) || !(near > far)) return 0;
  return std::sqrt(3 / (4 * std::log(near / far)));
}

/// Turns a line of values into the coefficients of the cubic spline through them, mirrored at its ends
/// (Unser's recursion; the pole's 16th power is below single precision). `step` apart, `n` long, `lanes` side by side.
void to_coefficients(float* values, std::ptrdiff_t step, int n, int lanes) {
  const float pole = std::sqrt(3.0f) - 2;
  const auto line = [&](int k) { return values + k * step; };
  std::vector<float> start(static_cast<std::size_t>(lanes), 0.0f);
  for (int k = std::min(16, n - 1); k >= 0; --k) {
    for (int l = 0; l < lanes; ++l) start[l] = pole * start[l] + line(k)[l];
  }
  for (int l = 0; l < lanes; ++l) line(0)[l] = start[l];
  for (int k = 1; k < n; ++k) {
    for (int l = 0; l < lanes; ++l) line(k)[l] += pole * line(k - 1)[l];
  }
  const float end = pole / (pole * pole - 1);
  for (int l = 0; l < lanes; ++l) line(n - 1)[l] = end * (line(n - 1)[l] + pole * line(n - 2)[l]);
  for (int k = n - 2; k >= 0; --k) {
    for (int l = 0; l < lanes; ++l) line(k)[l] = pole * (line(k + 1)[l] - line(k)[l]);
  }
  for (int k = 0; k < n; ++k) {
    for (int l = 0; l < lanes; ++l) line(k)[l] *= 6;
  }
}

}  // namespace

Plane without_background(const images::Image& image, double sigma) {
  Plane result{image.width, image.height, widely_blurred_values(image.pixels, image.width, image.height, sigma)};
  for (std::size_t k = 0; k < result.values.size(); ++k) result.values[k] = image.pixels[k] - result.values[k];
  return result;
}

Plane blurred(const Plane& plane, double sigma) {
  return {plane.width, plane.height, blurred_values(plane.values, plane.width, plane.height, sigma)};
}

void in_strips(int n, int threads, const std::function<void(int, int)>& body) {
  constexpr int kStrip = 64;
  numerics::parallel_for((n + kStrip - 1) / kStrip, threads,
                         [&](int strip) { body(strip * kStrip, std::min(n, (strip + 1) * kStrip)); });
}

double noise_of(const Plane& plane) {
  // Immerkaer's mask (CVIU 64:300, 1996), the difference of two Laplacians: blind to slopes and curvatures, norm 6
  std::vector<double> high;
  // a quarter of a million pixels give a quantile to 0.3 %
  const int step = 1 + static_cast<int>(std::sqrt(plane.values.size() / 2.5e5));
  for (int j = 1; j + 1 < plane.height; j += step) {
    const float *above = plane.row(j - 1), *here = plane.row(j), *below = plane.row(j + 1);
    for (int i = 1; i + 1 < plane.width; i += step) {
      const double corners = above[i - 1] + above[i + 1] + below[i - 1] + below[i + 1];
      const double sides = above[i] + below[i] + here[i - 1] + here[i + 1];
      high.push_back(std::abs(corners - 2 * sides + 4 * here[i]) / 6);
    }
  }
  // Low quantiles of |normal| (0.385, 0.674, 0.994 sd) stay clear of the beads; a camera that cuts noise off at zero
  // leaves exact zeros, so the larger of them counts.
  return std::max(
      {numerics::quantile(high, 0.3) / 0.3853, high.empty() ? 0 : 0.25 * numerics::quantile(high, 0.68) / 0.9945});
}

double bead_sigma_of(const Plane& plane) {
  const int side = std::min({64, plane.width - 2, plane.height - 2});
  std::vector<double> sigmas;
  if (side < 8) return 0;
  // some 100 tiles give the median to a few per cent, which is all a bead's width must be known to
  const int step = side * std::max(1, static_cast<int>(std::sqrt(plane.values.size() / 1e2) / side));
  for (int top = 0; top + side + 2 <= plane.height; top += step) {
    for (int left = 0; left + side + 2 <= plane.width; left += step) {
      const double sigma = sigma_of_tile(plane, left, top, side);
      if (sigma > 0) sigmas.push_back(sigma);
    }
  }
  return numerics::quantile(sigmas, 0.5);
}

double parabola_vertex(double before, double here, double after) {
  const double curvature = before - 2 * here + after;
  return curvature < 0 ? std::clamp(0.5 * (before - after) / curvature, -0.5, 0.5) : 0.0;
}

Spline spline_through(const Plane& plane, int threads) {
  const int width = plane.width, height = plane.height;
  Plane inner = plane;
  float* values = inner.values.data();
  in_strips(width, threads, [&](int from, int to) { to_coefficients(values + from, width, height, to - from); });
  in_strips(height, threads, [&](int from, int to) {
    for (int j = from; j < to; ++j) to_coefficients(values + static_cast<std::size_t>(j) * width, 1, width, 1);
  });
  const auto mirrored = [](int k, int n) { return k < 0 ? -k : k >= n ? 2 * n - 2 - k : k; };
  Spline result{.coefficients = {width + 3, height + 3, {}},
                .last_x = static_cast<float>(width - 1),
                .last_y = static_cast<float>(height - 1)};
  std::vector<float>& padded = result.coefficients.values;
  padded.resize(static_cast<std::size_t>(width + 3) * (height + 3));
  for (int j = 0; j < height + 3; ++j) {
    const float* from = inner.row(mirrored(j - 1, height));
    float* to = padded.data() + static_cast<std::size_t>(j) * (width + 3);
    std::copy(from, from + width, to + 1);
    to[0] = from[1], to[width + 1] = from[width - 2], to[width + 2] = from[width - 3];
  }
  return result;
}

SmoothImage smooth_image(Plane plane, int threads) {
  SmoothImage result;
  result.spline = spline_through(plane, threads);
  const Plane& c = result.spline.coefficients;
  result.slope_x = result.slope_y = {plane.width, plane.height, std::vector<float>(plane.values.size())};
  in_strips(plane.height, threads, [&](int from, int to) {
    for (int j = from; j < to; ++j) {
      const float *above = c.row(j), *here = c.row(j + 1), *below = c.row(j + 2);
      const std::size_t first = static_cast<std::size_t>(j) * plane.width;
      for (int i = 0; i < plane.width; ++i) {
        const auto along = [&](const float* row) { return row[i + 2] - row[i]; };
        const auto across = [&](int k) { return below[i + k] - above[i + k]; };
        result.slope_x.values[first + i] = (along(above) + 4 * along(here) + along(below)) / 12;
        result.slope_y.values[first + i] = (across(0) + 4 * across(1) + across(2)) / 12;
      }
    }
  });
  result.plane = std::move(plane);
  return result;
}

}  // namespace mbtfm::beads
