#include "segment/ridge.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <opencv2/imgproc.hpp>

#include "segment/grid.h"

namespace mbtfm::segment {

namespace {

using std::numbers::pi;

/// The filter's transfer function at angular frequencies (wx, wy) per pixel for lines along `e`.
///
/// K(n, t) = −∂²/∂n² of a Gaussian of widths (w, l). A line of profile exp(−n²/2w²) through it has the height
/// √(2π) w / (√(2π) √2 w) / (2 w²) = 1 / (2√2 w²), hence the factor in front.
double transfer(double wx, double wy, cv::Point2d e, double w, double l) {
  const double along = wx * e.x + wy * e.y, across = wy * e.x - wx * e.y;
  return 2 * std::numbers::sqrt2 * w * w * across * across *
         std::exp(-(w * w * across * across + l * l * along * along) / 2);
}

/// Root of the kernel's sum of squares: white noise of deviation 1 becomes this. From Parseval with Gaussian integrals:
/// ∫ (2√2 w²)² n⁴ exp(−w²n² − l²t²) dn dt / 4π² = 8 w⁴ · (3√π / 4w⁵) · (√π / l) / 4π² = 3 / (2π w l)
double norm_of_filter(double w, double l) { return std::sqrt(3 / (2 * pi * w * l)); }

struct Spectrum {
  cv::Mat values;  ///< CV_32FC2 of the padded image
  int margin;
};

Spectrum spectrum_of(const cv::Mat& image, int margin) {
  const int rows = cv::getOptimalDFTSize(image.rows + 2 * margin),
            columns = cv::getOptimalDFTSize(image.cols + 2 * margin);
  cv::Mat padded;
  cv::copyMakeBorder(image, padded, margin, rows - image.rows - margin, margin, columns - image.cols - margin,
                     cv::BORDER_REFLECT_101);
  Spectrum s{.values = {}, .margin = margin};
  cv::dft(padded, s.values, cv::DFT_COMPLEX_OUTPUT);
  return s;
}

double frequency(int i, int n) { return 2 * pi * (i <= n / 2 ? i : i - n) / n; }

/// Two directions in one inverse transform: both kernels are real and even, so their responses are real, and the
/// spectrum times (H₁ + i H₂) goes back to response 1 + i response 2.
void filter_pair(const Spectrum& s, cv::Point2d e1, cv::Point2d e2, double w, double l, cv::Mat& both) {
  const int rows = s.values.rows, columns = s.values.cols;
  cv::Mat product(rows, columns, CV_32FC2);
  for (int y = 0; y < rows; ++y) {
    const double wy = frequency(y, rows);
    const auto* from = s.values.ptr<std::complex<float>>(y);
    auto* to = product.ptr<std::complex<float>>(y);
    for (int x = 0; x < columns; ++x) {
      const double wx = frequency(x, columns);
      // exp(−20) and less does not reach single precision
      if (w * w * (wx * wx + wy * wy) > 40)
        to[x] = 0;
      else
        to[x] = from[x] * std::complex<float>(static_cast<float>(transfer(wx, wy, e1, w, l)),
                                              static_cast<float>(transfer(wx, wy, e2, w, l)));
    }
  }
  cv::dft(product, both, cv::DFT_INVERSE | cv::DFT_SCALE);
}

cv::Mat noise_of(const std::vector<cv::Mat>& responses, const cv::Mat& image, const RidgeScales& scales) {
  double gain = 0;
  for (const double w : scales.width_sigma_px) gain = std::max(gain, norm_of_filter(w, scales.length_sigma_px));
  const cv::Mat white = local_noise(image, scales.noise_radius_px) * gain;
  // four directions tell the texture; lines fill less than half of the disc in most of them
  constexpr int kSampled = 4;
  cv::Mat texture = cv::Mat::zeros(image.size(), CV_32F);
  const std::size_t step = std::max<std::size_t>(1, responses.size() / kSampled);
  int n = 0;
  for (std::size_t k = 0; k < responses.size(); k += step, ++n)
    texture += local_spread(responses[k], scales.noise_radius_px);
  return cv::max(white, texture / n);
}

}  // namespace

double Ridges::at(cv::Point2d point, double angle_rad) const {
  const int n = n_directions();
  double place = angle_rad / pi * n;
  place -= n * std::floor(place / n);
  const int k = static_cast<int>(place) % n;
  const double u = place - std::floor(place);
  return (1 - u) * sample(response[static_cast<std::size_t>(k)], point) +
         u * sample(response[static_cast<std::size_t>((k + 1) % n)], point);
}

Ridges find_ridges(const cv::Mat& image, const RidgeScales& scales, int n_directions) {
  const double l = scales.length_sigma_px;
  const Spectrum spectrum = spectrum_of(image, static_cast<int>(std::ceil(3 * l)));
  Ridges ridges;
  ridges.response.resize(static_cast<std::size_t>(n_directions));
  const cv::Rect inner(cv::Point(spectrum.margin, spectrum.margin), image.size());
  const auto along = [&](int k) {
    return cv::Point2d(std::cos(pi * k / n_directions), std::sin(pi * k / n_directions));
  };
  cv::parallel_for_(cv::Range(0, n_directions / 2), [&](const cv::Range& pairs) {
    for (int pair = pairs.start; pair < pairs.end; ++pair)
      for (const double w : scales.width_sigma_px) {
        cv::Mat both, parts[2];
        filter_pair(spectrum, along(2 * pair), along(2 * pair + 1), w, l, both);
        cv::split(both(inner), parts);
        for (int i = 0; i < 2; ++i) {
          cv::Mat& response = ridges.response[static_cast<std::size_t>(2 * pair + i)];
          response = response.empty() ? parts[i] : cv::Mat(cv::max(response, parts[i]));
        }
      }
  });
  ridges.noise = noise_of(ridges.response, image, scales);
  ridges.strongest = ridges.response[0].clone();
  ridges.direction = cv::Mat::zeros(image.size(), CV_32S);
  for (int k = 1; k < n_directions; ++k) {
    const cv::Mat& response = ridges.response[static_cast<std::size_t>(k)];
    ridges.direction.setTo(k, response > ridges.strongest);
    ridges.strongest = cv::max(ridges.strongest, response);
  }
  return ridges;
}

}  // namespace mbtfm::segment
