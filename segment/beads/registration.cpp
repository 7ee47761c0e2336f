#include "segment/beads/registration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/core/hal/intrin.hpp>

namespace mbtfm::beads {
namespace {

/// Compiled a second time for processors that add eight floats at once: the same sums in the same order, since nothing
/// is multiplied and added in one step, so the same bytes. (A sanitizer of threads is not up yet when such a choice is
/// made.)
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_THREAD__)
#define MBTFM_EIGHT_AT_ONCE __attribute__((target_clones("avx2", "default")))
#else
#define MBTFM_EIGHT_AT_ONCE
#endif

using Vec6 = cv::Vec<double, 6>;
using Mat6 = cv::Matx<double, 6, 6>;

/// Weights of the cubic B-spline's four coefficients at a fraction of the way between the middle two
/// (Unser, IEEE Signal Process Mag 16(6):22, 1999), as polynomials of it.
cv::v_float32x4 spline_weights(float t) {
  constexpr float k0[4] = {1.0f / 6, 2.0f / 3, 1.0f / 6, 0}, k1[4] = {-0.5f, 0, 0.5f, 0}, k2[4] = {0.5f, -1, 0.5f, 0},
                  k3[4] = {-1.0f / 6, 0.5f, -0.5f, 1.0f / 6};
  const cv::v_float32x4 at = cv::v_setall_f32(t);
  return cv::v_load(k0) + at * (cv::v_load(k1) + at * (cv::v_load(k2) + at * cv::v_load(k3)));
}

/// Beyond the border the last pixel goes on.
float interpolated(const Spline& spline, float x, float y) {
  x = std::clamp(x, 0.0f, spline.last_x);
  y = std::clamp(y, 0.0f, spline.last_y);
  const int i = static_cast<int>(x), j = static_cast<int>(y);
  const cv::v_float32x4 wx = spline_weights(x - static_cast<float>(i)), wy = spline_weights(y - static_cast<float>(j));
  const int width = spline.coefficients.width;
  const float* row = spline.coefficients.row(j) + i;  // one pixel before: the margin
  const cv::v_float32x4 column = cv::v_load(row) * cv::v_broadcast_element<0>(wy) +
                                 cv::v_load(row + width) * cv::v_broadcast_element<1>(wy) +
                                 cv::v_load(row + 2 * width) * cv::v_broadcast_element<2>(wy) +
                                 cv::v_load(row + 3 * width) * cv::v_broadcast_element<3>(wy);
  return cv::v_reduce_sum(column * wx);
}

/// Of the value at a pixel by u and G; the two places left, up to what the processor adds at once, take the value and
/// one where sums with them are needed, too.
using Slope = std::array<float, 8>;
constexpr int kValue = 6, kOne = 7;

/// Σ factor s sᵀ, in single precision: a window has at most some 1 500 pixels.
struct Products {
  std::array<Slope, 6> sum{};
  void add(float factor, const Slope& slope) {
    for (int a = 0; a < 6; ++a) {
      const float scaled = factor * slope[a];
      for (int b = 0; b < 8; ++b) sum[a][b] += scaled * slope[b];
    }
  }
  Mat6 matrix() const {
    Mat6 result;
    for (int a = 0; a < 6; ++a) {
      for (int b = 0; b < 6; ++b) result(a, b) = sum[std::min(a, b)][std::max(a, b)];
    }
    return result;
  }
};

/// What a spot of height 1 adds at a place, by the squared distance in px.
float shape(float squared, double sigma) { return std::exp(-0.5f * squared / static_cast<float>(sigma * sigma)); }

/// Everything of a pixel of a window that does not change from step to step.
struct Pixel {
  float x, y;    ///< from the bead
  float target;  ///< the target's value there, as moved last
  float weight;
  Slope slope;  ///< by u and G, less what gain and offset can do; the value, less the weighted mean; one
  float value() const { return slope[kValue]; }
};

struct Patch {
  std::vector<Pixel> pixels;
  Mat6 normal;
  double total_weight = 0, variance = 0;
};

/// Take the other beads of the reference away from values and slopes.
void take_away(Patch& patch, Vec2 place, const Others& others) {
  const float per_square = static_cast<float>(1 / (others.sigma * others.sigma));
  for (const Others::Spot& spot : others.in_reference) {
    const float sx = static_cast<float>(spot.place.x - place.x), sy = static_cast<float>(spot.place.y - place.y);
    for (Pixel& p : patch.pixels) {
      const float dx = p.x - sx, dy = p.y - sy;
      const float light = static_cast<float>(spot.height) * shape(dx * dx + dy * dy, others.sigma);
      const float gx = -light * dx * per_square, gy = -light * dy * per_square;
      const Slope own{gx, gy, gx * p.x, gx * p.y, gy * p.x, gy * p.y, light, 0};
      for (int a = 0; a < 8; ++a) p.slope[a] -= own[a];
    }
  }
}

constexpr float kLeastWeight = 0.105f;  // at 2.12 sigmas: nine tenths of a Gaussian's volume lie within

/// exp(−d²/2s²) on the pixels around the middle one.
std::vector<float> weights_along(double place, int middle, int reach, double sigma) {
  std::vector<float> result;
  for (int k = middle - reach; k <= middle + reach; ++k) {
    const double d = (k - place) / sigma;
    result.push_back(static_cast<float>(std::exp(-0.5 * d * d)));
  }
  return result;
}

Patch patch_around(const SmoothImage& reference, Vec2 place, const Window& window, const Others& others) {
  Patch patch;
  const int reach = static_cast<int>(std::ceil(2 * window.sigma));
  const int ci = static_cast<int>(std::lround(place.x)), cj = static_cast<int>(std::lround(place.y));
  const std::vector<float> along_x = weights_along(place.x, ci, reach, window.sigma);
  const std::vector<float> along_y = weights_along(place.y, cj, reach, window.sigma);
  patch.pixels.reserve(along_x.size() * along_y.size() / (window.is_thinned ? 2 : 1) + 1);
  const int left = std::max(0, ci - reach), right = std::min(reference.plane.width - 1, ci + reach);
  for (int j = std::max(0, cj - reach); j <= std::min(reference.plane.height - 1, cj + reach); ++j) {
    const float *values = reference.plane.row(j), *slope_x = reference.slope_x.row(j),
                *slope_y = reference.slope_y.row(j);
    const float y = static_cast<float>(j - place.y), weight_y = along_y[j - cj + reach];
    const int step = window.is_thinned ? 2 : 1;  // of a chessboard the bead's own pixel is one
    for (int i = left + (window.is_thinned ? (left + j + ci + cj) & 1 : 0); i <= right; i += step) {
      const float weight = weight_y * along_x[i - ci + reach];
      if (weight < kLeastWeight) continue;
      const float x = static_cast<float>(i - place.x), gx = slope_x[i], gy = slope_y[i];
      patch.pixels.push_back({x, y, 0, weight, {gx, gy, gx * x, gx * y, gy * x, gy * y, values[i], 1}});
    }
  }
  take_away(patch, place, others);
  return patch;
}

/// Project the slopes onto what neither an offset nor a gain can do, and sum their products.
MBTFM_EIGHT_AT_ONCE void complete(Patch& patch) {
  Slope by_one{}, by_value{};
  for (const Pixel& p : patch.pixels) {
    for (int a = 0; a < 8; ++a) by_one[a] += p.weight * p.slope[a];
  }
  patch.total_weight = by_one[kOne];
  const float mean = by_one[kValue] / by_one[kOne];
  for (Pixel& p : patch.pixels) {
    p.slope[kValue] -= mean;
    const float weighted = p.weight * p.value();
    for (int a = 0; a < 8; ++a) by_value[a] += weighted * p.slope[a];
  }
  const float power = by_value[kValue];
  patch.variance = power / patch.total_weight;
  for (int a = 0; a < 6; ++a) {
    by_one[a] /= by_one[kOne];
    by_value[a] = power > 0 ? by_value[a] / power : 0.0f;
  }
  by_one[kValue] = by_one[kOne] = by_value[kValue] = by_value[kOne] = 0;
  Products products;
  for (Pixel& p : patch.pixels) {
    const float value = p.value();
    for (int a = 0; a < 8; ++a) p.slope[a] -= by_one[a] + by_value[a] * value;
    products.add(p.weight, p.slope);
  }
  patch.normal = products.matrix();
}

/// The sampled place of pixel k of a patch in the target.
struct Warp {
  float ux, uy, xx, xy, yx, yy;
  Warp(Vec2 place, const Motion& motion)
      : ux(static_cast<float>(place.x + motion.u.x)),
        uy(static_cast<float>(place.y + motion.u.y)),
        xx(static_cast<float>(1 + motion.ux_x)),
        xy(static_cast<float>(motion.ux_y)),
        yx(static_cast<float>(motion.uy_x)),
        yy(static_cast<float>(1 + motion.uy_y)) {}
  float x_of(float x, float y) const { return ux + xx * x + xy * y; }
  float y_of(float x, float y) const { return uy + yx * x + yy * y; }
};

/// What the target shows under the window moved by a motion.
struct Compared {
  Vec6 mismatch;    ///< Σ w s target
  double gain = 0;  ///< of the target over the reference
  double similarity = 0;
  double mean = 0;  ///< of the target
};

MBTFM_EIGHT_AT_ONCE Compared compared(Patch& patch, const Spline& target, Vec2 place, const Motion& motion,
                                      const Others& others) {
  Compared result;
  Slope sums{};
  float squares = 0;
  const Warp warp(place, motion);
  for (Pixel& p : patch.pixels) {
    const float there_x = warp.x_of(p.x, p.y), there_y = warp.y_of(p.x, p.y);
    float value = interpolated(target, there_x, there_y);
    for (const Others::Spot& spot : others.in_target) {
      const float dx = there_x - static_cast<float>(spot.place.x), dy = there_y - static_cast<float>(spot.place.y);
      value -= static_cast<float>(spot.height) * shape(dx * dx + dy * dy, others.sigma);
    }
    p.target = value;
    const float weighted = p.weight * value;
    squares += weighted * value;
    for (int a = 0; a < 8; ++a) sums[a] += weighted * p.slope[a];
  }
  for (int a = 0; a < 6; ++a) result.mismatch[a] = sums[a];
  const double mean = sums[kOne] / patch.total_weight;
  const double variance = squares / patch.total_weight - mean * mean;
  const double covariance = sums[kValue] / patch.total_weight;
  result.gain = covariance / patch.variance;
  result.similarity = variance > 0 ? covariance / std::sqrt(patch.variance * variance) : 0;
  result.mean = mean;
  return result;
}

/// Share of white noise's variance that the spline has left at a place between two pixels: within 0.002.
float noise_left(float place) {
  const float size = std::abs(place), t = size - static_cast<float>(static_cast<int>(size));
  const float p = t * (1 - t);
  return 1 - p * p * (3 + 3.7f * p);
}

/// Variance of a component of u, mean of both: H⁻¹ (Σ w² s sᵀ r² / (1 − h) + prior) H⁻¹. The residual's scatter r²
/// counts pixel by pixel as it is (shot noise is largest on the beads, where the slopes are); h is the share of a
/// pixel's own noise that the fit follows (MacKinnon & White, J Econometrics 29:305, 1985, estimator HC2), left out
/// where `has_many` pixels share it.
MBTFM_EIGHT_AT_ONCE double variance_of(const Patch& patch, const Warp& warp, const Mat6& inverse, const Compared& now,
                                       double prior, bool has_many) {
  std::array<Slope, 6> single{};
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b < 6; ++b) single[a][b] = static_cast<float>(inverse(a, b));
  }
  const float per_weight = static_cast<float>(1 / patch.total_weight);
  const float per_power = static_cast<float>(1 / (patch.variance * patch.total_weight));
  const float mean = static_cast<float>(now.mean), per_gain = static_cast<float>(1 / now.gain);
  const auto followed = [&](const Pixel& p) {
    Slope solved{};
    for (int a = 0; a < 6; ++a) {
      for (int b = 0; b < 8; ++b) solved[b] += single[a][b] * p.slope[a];
    }
    float share = per_weight + per_power * p.value() * p.value();
    for (int a = 0; a < 6; ++a) share += p.slope[a] * solved[a];
    return std::min(0.9f, p.weight * share);
  };
  double sum = 0;
  for (const Pixel& p : patch.pixels) {
    float ux = 0, uy = 0;
    for (int a = 0; a < 6; ++a) ux += single[0][a] * p.slope[a], uy += single[1][a] * p.slope[a];
    const float own = has_many ? 0 : followed(p);
    const float weighted = p.weight * ((p.target - mean) * per_gain - p.value());
    // Interpolation takes from the target's noise, but nothing from its slow part, which moves the answer: of equal
    // noise in both images the residual shows (1 + left) / 2.
    const float left = noise_left(warp.x_of(p.x, p.y)) * noise_left(warp.y_of(p.x, p.y));
    sum += 2 / (1 + left) * weighted * weighted / (1 - own) * (ux * ux + uy * uy);
  }
  for (int a = 2; a < 6; ++a) sum += prior * (inverse(0, a) * inverse(0, a) + inverse(1, a) * inverse(1, a));
  return 0.5 * sum;
}

/// The same where residuals are alike over squares of `side` px: the sum over each counts as one.
double variance_of_squares(const Patch& patch, const Mat6& inverse, const Compared& now, double prior, int side) {
  float reach = 0;
  for (const Pixel& p : patch.pixels) reach = std::max({reach, std::abs(p.x), std::abs(p.y)});
  const int n = 1 + static_cast<int>(2 * reach) / side;
  const auto square_of = [&](float offset) { return static_cast<int>(offset + reach) / side; };
  std::vector<Vec2> squares(static_cast<std::size_t>(n) * n);
  for (const Pixel& p : patch.pixels) {
    double ux = 0, uy = 0;
    for (int a = 0; a < 6; ++a) ux += inverse(0, a) * p.slope[a], uy += inverse(1, a) * p.slope[a];
    const double weighted = p.weight * ((p.target - now.mean) / now.gain - p.value());
    squares[static_cast<std::size_t>(square_of(p.y)) * n + square_of(p.x)] += weighted * Vec2{ux, uy};
  }
  double sum = 0;
  for (const Vec2 moved : squares) sum += dot(moved, moved);
  for (int a = 2; a < 6; ++a) sum += prior * (inverse(0, a) * inverse(0, a) + inverse(1, a) * inverse(1, a));
  return 0.5 * sum;
}

/// x → W(V⁻¹(x)), with V(x) = x + step(x).
Motion composed(const Motion& motion, const Vec6& step) {
  const cv::Matx22d moved(1 + motion.ux_x, motion.ux_y, motion.uy_x, 1 + motion.uy_y);
  const cv::Matx22d all = moved * cv::Matx22d(1 + step[2], step[3], step[4], 1 + step[5]).inv();
  const cv::Vec2d shift = all * cv::Vec2d(step[0], step[1]);
  return {{motion.u.x - shift[0], motion.u.y - shift[1]}, all(0, 0) - 1, all(0, 1), all(1, 0), all(1, 1) - 1};
}

Vec6 gradient_difference(const Motion& a, const Motion& b) {
  return {0, 0, a.ux_x - b.ux_x, a.ux_y - b.ux_y, a.uy_x - b.uy_x, a.uy_y - b.uy_y};
}

}  // namespace

float value_at(const Spline& spline, Vec2 place) {
  return interpolated(spline, static_cast<float>(place.x), static_cast<float>(place.y));
}

Registered registered(const SmoothImage& reference, const Spline& target, Vec2 place, const Motion& guess,
                      const Window& window, const Others& others) {
  Registered result;
  result.motion = guess;
  Patch patch = patch_around(reference, place, window, others);
  complete(patch);
  if (!(patch.variance > 0)) return result;
  Mat6 prior;
  const double stiffness = window.noise * window.noise / (window.gradient_sd * window.gradient_sd);
  for (int a = 2; a < 6; ++a) prior(a, a) = stiffness;
  bool is_regular = false;
  const Mat6 inverse = (patch.normal + prior).inv(cv::DECOMP_CHOLESKY, &is_regular);
  if (!is_regular) return result;
  Compared now;
  for (int step = 0; step < window.max_steps; ++step) {
    now = compared(patch, target, place, result.motion, others);
    if (!(now.gain > 0)) return result;
    const Vec6 change = inverse * (now.mismatch * (1 / now.gain) + prior * gradient_difference(result.motion, guess));
    const double shift = std::hypot(change[0], change[1]);
    const double share = shift > 1 ? 1 / shift : 1;  // a slope shows nothing beyond a bead's flank
    result.motion = composed(result.motion, share * change);
    constexpr double kFarthest = 50;  // px; steps are of a pixel at most, but a gradient that runs off magnifies them
    if (!is_finite(result.motion.u) || norm(result.motion.u - guess.u) > kFarthest) {
      result.motion = guess;  // what ran off leads nowhere
      return result;
    }
    if (shift < window.settled_px) {
      result.is_converged = true;
      break;
    }
  }
  result.similarity = now.similarity;
  result.variance = patch.variance;
  result.gain = now.gain;
  if (!window.states_error) return result;
  const double prior_variance = stiffness * window.noise * window.noise;
  const double variance =
      window.alike_px > 1
          ? variance_of_squares(patch, inverse, now, prior_variance, window.alike_px)
          : variance_of(patch, Warp(place, result.motion), inverse, now, prior_variance, window.is_thinned);
  result.sigma_px = std::sqrt(std::max(0.0, variance));
  return result;
}

}  // namespace mbtfm::beads
