#include "segment/registration.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <opencv2/core.hpp>
#include <opencv2/core/hal/intrin.hpp>

namespace mbtfm::segment {
namespace {

using Vec6 = cv::Vec<double, 6>;
using Mat6 = cv::Matx<double, 6, 6>;

/// Catmull–Rom weights of four neighbouring pixels at a fraction of the way between the middle two.
struct Weights {
  float w[4];
  explicit Weights(float t) {
    const float t2 = t * t, t3 = t2 * t;
    w[0] = 0.5f * (-t + 2 * t2 - t3);
    w[1] = 0.5f * (2 - 5 * t2 + 3 * t3);
    w[2] = 0.5f * (t + 4 * t2 - 3 * t3);
    w[3] = 0.5f * (t3 - t2);
  }
};

/// Beyond the border the last pixel goes on.
float interpolated(const Plane& plane, float x, float y) {
  x = std::clamp(x, 0.0f, static_cast<float>(plane.width - 1));
  y = std::clamp(y, 0.0f, static_cast<float>(plane.height - 1));
  const int i = std::min(static_cast<int>(x), plane.width - 2), j = std::min(static_cast<int>(y), plane.height - 2);
  const Weights wx(x - static_cast<float>(i)), wy(y - static_cast<float>(j));
  if (i >= 1 && j >= 1 && i + 2 < plane.width && j + 2 < plane.height) {
    const float* row = plane.row(j - 1) + i - 1;
    cv::v_float32x4 column = cv::v_load(row) * cv::v_setall_f32(wy.w[0]);
    for (int b = 1; b < 4; ++b)
      column = cv::v_muladd(cv::v_load(row + b * plane.width), cv::v_setall_f32(wy.w[b]), column);
    return cv::v_reduce_sum(column * cv::v_load(wx.w));
  }
  float sum = 0;
  for (int b = 0; b < 4; ++b) {
    const float* row = plane.row(std::clamp(j - 1 + b, 0, plane.height - 1));
    for (int a = 0; a < 4; ++a) sum += wy.w[b] * wx.w[a] * row[std::clamp(i - 1 + a, 0, plane.width - 1)];
  }
  return sum;
}

/// Of the value at a pixel by u and G; two zeros fill it up to what the processor adds at once.
using Slope = std::array<float, 8>;

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

/// Everything of a window that does not change from step to step.
struct Patch {
  std::vector<float> x, y;           ///< of its pixels, from the bead
  std::vector<float> target;         ///< the target's values under the window, as moved last
  std::vector<float> weight, value;  ///< value: less the weighted mean
  std::vector<Slope> slope;          ///< by u and G, less what gain and offset can do
  Mat6 normal;
  double total_weight = 0, total_squared = 0, variance = 0;
};

Patch patch_around(const Reference& reference, Vec2 place, double sigma) {
  Patch patch;
  const int reach = static_cast<int>(std::ceil(2 * sigma));
  const int ci = static_cast<int>(std::lround(place.x)), cj = static_cast<int>(std::lround(place.y));
  const std::size_t most = static_cast<std::size_t>(2 * reach + 1) * (2 * reach + 1);
  for (auto* list : {&patch.x, &patch.y, &patch.weight, &patch.value}) list->reserve(most);
  patch.slope.reserve(most);
  double mean = 0;
  for (int j = std::max(0, cj - reach); j <= std::min(reference.plane.height - 1, cj + reach); ++j) {
    for (int i = std::max(0, ci - reach); i <= std::min(reference.plane.width - 1, ci + reach); ++i) {
      const float x = static_cast<float>(i - place.x), y = static_cast<float>(j - place.y);
      const float squared = (x * x + y * y) / static_cast<float>(sigma * sigma);
      if (squared > 4.5f) continue;
      const float weight = std::exp(-0.5f * squared);
      const float gx = reference.slope_x.at(i, j), gy = reference.slope_y.at(i, j);
      patch.x.push_back(x), patch.y.push_back(y), patch.weight.push_back(weight);
      patch.value.push_back(reference.plane.at(i, j));
      patch.slope.push_back({gx, gy, gx * x, gx * y, gy * x, gy * y, 0, 0});
      patch.total_weight += weight, patch.total_squared += weight * weight;
      mean += weight * patch.value.back();
    }
  }
  for (float& value : patch.value) value -= static_cast<float>(mean / patch.total_weight);
  return patch;
}

/// Project the slopes onto what neither an offset nor a gain can do, and sum their products.
void complete(Patch& patch) {
  Slope by_one{}, by_value{};
  double power = 0;
  const std::size_t n = patch.value.size();
  for (std::size_t k = 0; k < n; ++k) {
    const float weight = patch.weight[k], weighted = weight * patch.value[k];
    power += weighted * patch.value[k];
    for (int a = 0; a < 8; ++a) {
      by_one[a] += weight * patch.slope[k][a];
      by_value[a] += weighted * patch.slope[k][a];
    }
  }
  patch.target.resize(n);
  patch.variance = power / patch.total_weight;
  for (int a = 0; a < 8; ++a) {
    by_one[a] /= static_cast<float>(patch.total_weight);
    by_value[a] = power > 0 ? by_value[a] / static_cast<float>(power) : 0.0f;
  }
  Products products;
  for (std::size_t k = 0; k < n; ++k) {
    for (int a = 0; a < 8; ++a) patch.slope[k][a] -= by_one[a] + by_value[a] * patch.value[k];
    products.add(patch.weight[k], patch.slope[k]);
  }
  patch.normal = products.matrix();
}

/// What the target shows under the window moved by a motion.
struct Compared {
  Vec6 mismatch;    ///< Σ w s target
  double gain = 0;  ///< of the target over the reference
  double similarity = 0;
  double mean = 0;  ///< of the target
};

Compared compared(Patch& patch, const Plane& target, Vec2 place, const Motion& motion) {
  Compared result;
  Slope mismatch{};
  double sum = 0, squares = 0, products = 0;
  const float ux = static_cast<float>(place.x + motion.u.x), uy = static_cast<float>(place.y + motion.u.y);
  const float xx = static_cast<float>(1 + motion.ux_x), xy = static_cast<float>(motion.ux_y);
  const float yx = static_cast<float>(motion.uy_x), yy = static_cast<float>(1 + motion.uy_y);
  for (std::size_t k = 0; k < patch.value.size(); ++k) {
    const float x = patch.x[k], y = patch.y[k];
    const float value = interpolated(target, ux + xx * x + xy * y, uy + yx * x + yy * y);
    patch.target[k] = value;
    const float weighted = patch.weight[k] * value;
    sum += weighted;
    squares += weighted * value;
    products += weighted * patch.value[k];
    for (int a = 0; a < 8; ++a) mismatch[a] += weighted * patch.slope[k][a];
  }
  for (int a = 0; a < 6; ++a) result.mismatch[a] = mismatch[a];
  const double mean = sum / patch.total_weight;
  const double variance = squares / patch.total_weight - mean * mean;
  const double covariance = products / patch.total_weight;
  result.gain = covariance / patch.variance;
  result.similarity = variance > 0 ? covariance / std::sqrt(patch.variance * variance) : 0;
  result.mean = mean;
  return result;
}

/// Σ w² s sᵀ r² / (1 − h): what the residual's scatter, pixel by pixel as it is (shot noise is largest on the beads,
/// where the slopes are), does to the mismatch. h is the share of a pixel's own noise that the fit follows
/// (MacKinnon & White, J Econometrics 29:305, 1985, estimator HC2).
Mat6 spread_of_residual(const Patch& patch, const Mat6& inverse, const Compared& now) {
  // Interpolation at a random place leaves 0.64 of the target's noise variance in the residual, but takes nothing from
  // its slow part, which moves the answer: with equal noise in both images the residual shows (1 + 0.64) / 2 of it.
  constexpr double kInterpolation = 2 / 1.64;
  std::array<Slope, 6> single{};
  for (int a = 0; a < 6; ++a) {
    for (int b = 0; b < 6; ++b) single[a][b] = static_cast<float>(inverse(a, b));
  }
  const float per_weight = static_cast<float>(1 / patch.total_weight);
  const float per_power = static_cast<float>(1 / (patch.variance * patch.total_weight));
  Products spread;
  for (std::size_t k = 0; k < patch.value.size(); ++k) {
    const Slope& slope = patch.slope[k];
    Slope solved{};
    for (int a = 0; a < 6; ++a) {
      for (int b = 0; b < 8; ++b) solved[b] += single[a][b] * slope[a];
    }
    float followed = per_weight + per_power * patch.value[k] * patch.value[k];
    for (int a = 0; a < 6; ++a) followed += slope[a] * solved[a];
    const float own = std::min(0.9f, patch.weight[k] * followed);
    const float residual = static_cast<float>((patch.target[k] - now.mean) / now.gain) - patch.value[k];
    const float weighted = patch.weight[k] * residual;
    spread.add(static_cast<float>(kInterpolation) * weighted * weighted / (1 - own), slope);
  }
  return spread.matrix();
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

Reference with_slopes(Plane plane) {
  Reference result{plane, plane, plane};
  for (int j = 0; j < plane.height; ++j) {
    for (int i = 0; i < plane.width; ++i) {
      const std::size_t k = static_cast<std::size_t>(j) * plane.width + i;
      const int left = std::max(i - 1, 0), right = std::min(i + 1, plane.width - 1);
      const int above = std::max(j - 1, 0), below = std::min(j + 1, plane.height - 1);
      result.slope_x.values[k] = 0.5f * (plane.at(right, j) - plane.at(left, j));
      result.slope_y.values[k] = 0.5f * (plane.at(i, below) - plane.at(i, above));
    }
  }
  return result;
}

Registered registered(const Reference& reference, const Plane& target, Vec2 place, const Motion& guess,
                      const Window& window) {
  Registered result;
  result.motion = guess;
  Patch patch = patch_around(reference, place, window.sigma);
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
    now = compared(patch, target, place, result.motion);
    if (!(now.gain > 0)) return result;
    const Vec6 change = inverse * (now.mismatch * (1 / now.gain) + prior * gradient_difference(result.motion, guess));
    const double shift = std::hypot(change[0], change[1]);
    const double share = shift > 1 ? 1 / shift : 1;  // a slope tells nothing beyond a bead's flank
    result.motion = composed(result.motion, share * change);
    if (!is_finite(result.motion.u) || std::abs(result.motion.u.x - guess.u.x) > 50) return result;
    constexpr double kSettled = 2e-3;  // px, a tenth of the best standard errors
    if (shift < kSettled) {
      result.is_converged = true;
      break;
    }
  }
  now = compared(patch, target, place, result.motion);
  result.similarity = now.similarity;
  const Mat6 covariance =
      inverse * (spread_of_residual(patch, inverse, now) + prior * (window.noise * window.noise)) * inverse;
  result.sigma_px = std::sqrt(std::max(0.0, 0.5 * (covariance(0, 0) + covariance(1, 1))));
  return result;
}

}  // namespace mbtfm::segment
