#include "segment/beads.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/parallel.h"

namespace mbtfm::segment {
namespace {

/// Difference of two Gaussian averages, of 0.8 and 1.6 bead sigmas: the first keeps touching beads apart, the second
/// takes away what is wider than a bead.
struct BandPass {
  double narrow, wide;
  /// Height of the answer to a spot of height 1.
  double answer(double sigma) const {
    const double s = sigma * sigma;
    return s / (s + narrow * narrow) - s / (s + wide * wide);
  }
  /// Standard deviation of the answer to white noise of 1.
  double noise_gain() const {
    const double a = narrow * narrow, b = wide * wide;
    return std::sqrt((1 / (4 * a) + 1 / (4 * b) - 1 / (a + b)) / std::numbers::pi);
  }
};

Plane filtered(const Plane& plane, const BandPass& band) {
  Plane result = blurred(plane, band.narrow);
  const Plane wide = blurred(plane, band.wide);
  for (std::size_t k = 0; k < result.values.size(); ++k) result.values[k] -= wide.values[k];
  return result;
}

/// Of equal pixels the first counts.
bool is_peak(const Plane& plane, int i, int j) {
  const float value = plane.at(i, j);
  for (int dj = -1; dj <= 1; ++dj) {
    for (int di = -1; di <= 1; ++di) {
      if (di == 0 && dj == 0) continue;
      const bool is_before = dj < 0 || (dj == 0 && di < 0);
      const float other = plane.at(i + di, j + dj);
      if (is_before ? other >= value : other > value) return false;
    }
  }
  return true;
}

/// Vertex of the parabola through three values, within half a pixel.
double vertex(double before, double here, double after) {
  const double curvature = before - 2 * here + after;
  return curvature < 0 ? std::clamp(0.5 * (before - after) / curvature, -0.5, 0.5) : 0.0;
}

std::vector<DetectedBead> peaks(const Plane& band, double threshold, double height_by_answer) {
  std::vector<DetectedBead> result;
  for (int j = 1; j + 1 < band.height; ++j) {
    for (int i = 1; i + 1 < band.width; ++i) {
      if (band.at(i, j) < threshold || !is_peak(band, i, j)) continue;
      result.push_back({{i + vertex(band.at(i - 1, j), band.at(i, j), band.at(i + 1, j)),
                         j + vertex(band.at(i, j - 1), band.at(i, j), band.at(i, j + 1))},
                        band.at(i, j) * height_by_answer});
    }
  }
  return result;
}

/// exp(−d²/2s²) on the pixels from `first` on.
std::vector<float> profile(double centre, int first, int n, double sigma) {
  std::vector<float> result(static_cast<std::size_t>(n));
  for (int k = 0; k < n; ++k) {
    const double d = (first + k - centre) / sigma;
    result[k] = static_cast<float>(std::exp(-0.5 * d * d));
  }
  return result;
}

struct Box {
  int left, top, right, bottom;  ///< inclusive
};

Box box_around(const Plane& plane, Vec2 centre, int reach) {
  const int i = static_cast<int>(std::lround(centre.x)), j = static_cast<int>(std::lround(centre.y));
  return {std::max(0, i - reach), std::max(0, j - reach), std::min(plane.width - 1, i + reach),
          std::min(plane.height - 1, j + reach)};
}

Plane picture_of(const std::vector<DetectedBead>& beads, const Plane& like, double sigma) {
  Plane result{like.width, like.height, std::vector<float>(like.values.size(), 0.0f)};
  const int reach = static_cast<int>(std::ceil(4 * sigma));
  for (const DetectedBead& bead : beads) {
    const Box box = box_around(like, bead.position_px, reach);
    const auto x = profile(bead.position_px.x, box.left, box.right - box.left + 1, sigma);
    const auto y = profile(bead.position_px.y, box.top, box.bottom - box.top + 1, sigma);
    for (int j = box.top; j <= box.bottom; ++j) {
      float* row = result.values.data() + static_cast<std::size_t>(j) * like.width;
      const float height = static_cast<float>(bead.brightness) * y[j - box.top];
      for (int i = box.left; i <= box.right; ++i) row[i] += height * x[i - box.left];
    }
  }
  return result;
}

/// Solve a symmetric positive system of 4 by Cholesky; false where it is singular.
bool solve(std::array<double, 16>& a, std::array<double, 4>& b) {
  for (int i = 0; i < 4; ++i) {
    for (int j = 0; j <= i; ++j) {
      double sum = a[4 * i + j];
      for (int k = 0; k < j; ++k) sum -= a[4 * i + k] * a[4 * j + k];
      if (i == j && !(sum > 1e-12)) return false;
      a[4 * i + j] = i == j ? std::sqrt(sum) : sum / a[4 * j + j];
    }
  }
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < i; ++k) b[i] -= a[4 * i + k] * b[k];
    b[i] /= a[5 * i];
  }
  for (int i = 3; i >= 0; --i) {
    for (int k = i + 1; k < 4; ++k) b[i] -= a[4 * k + i] * b[k];
    b[i] /= a[5 * i];
  }
  return true;
}

/// One Gauss–Newton step of height, place and level of a spot on what the other spots leave, weighted by a Gaussian of
/// 1.5 bead sigmas. Steps are held to half a pixel: touching beads are fitted in turns.
DetectedBead improved(const DetectedBead& bead, const Plane& plane, const Plane& model, double sigma) {
  const Box box = box_around(plane, bead.position_px, static_cast<int>(std::ceil(2.5 * sigma)));
  const auto x = profile(bead.position_px.x, box.left, box.right - box.left + 1, sigma);
  const auto y = profile(bead.position_px.y, box.top, box.bottom - box.top + 1, sigma);
  std::array<double, 16> normal{};
  std::array<double, 4> right{};
  for (int j = box.top; j <= box.bottom; ++j) {
    for (int i = box.left; i <= box.right; ++i) {
      const double shape = x[i - box.left] * y[j - box.top];
      const double dx = (i - bead.position_px.x) / sigma, dy = (j - bead.position_px.y) / sigma;
      const double weight = std::exp(-0.5 * (dx * dx + dy * dy) / 2.25);
      const std::array<double, 4> slope{shape, shape * dx, shape * dy, 1};  // the place in units of sigma/height
      const double residual = plane.at(i, j) - model.at(i, j);
      for (int a = 0; a < 4; ++a) {
        for (int b = 0; b <= a; ++b) normal[4 * a + b] += weight * slope[a] * slope[b];
        right[a] += weight * slope[a] * residual;
      }
    }
  }
  if (!solve(normal, right) || !(bead.brightness > 0)) return bead;
  DetectedBead result = bead;
  const double to_px = sigma / bead.brightness;
  result.position_px.x += std::clamp(right[1] * to_px, -0.5, 0.5);
  result.position_px.y += std::clamp(right[2] * to_px, -0.5, 0.5);
  result.brightness = std::clamp(bead.brightness + right[0], 0.5 * bead.brightness, 2 * bead.brightness);
  return result;
}

}  // namespace

double background_sigma(double bead_sigma) { return std::max(6 * bead_sigma, 8.0); }

std::vector<DetectedBead> fitted_spots(const Plane& plane, std::vector<DetectedBead> spots, double bead_sigma,
                                       int rounds, int threads) {
  for (int round = 0; round < rounds; ++round) {
    const Plane model = picture_of(spots, plane, bead_sigma);
    std::vector<DetectedBead> next(spots.size());
    constexpr int kChunk = 256;
    const int n = static_cast<int>(spots.size());
    parallel_for((n + kChunk - 1) / kChunk, threads, [&](int chunk) {
      for (int k = chunk * kChunk; k < std::min(n, (chunk + 1) * kChunk); ++k) {
        next[k] = improved(spots[k], plane, model, bead_sigma);
      }
    });
    for (int k = 0; k < n; ++k) {  // a fit that runs away from its maximum is not believed
      if (norm(next[k].position_px - spots[k].position_px) < bead_sigma) spots[k] = next[k];
    }
  }
  return spots;
}

std::vector<DetectedBead> find_spots(const Plane& plane, double bead_sigma, double noise, double detection_snr,
                                     int threads) {
  const BandPass band{0.8 * bead_sigma, 1.6 * bead_sigma};
  const Plane answers = filtered(plane, band);
  std::vector<DetectedBead> beads =
      peaks(answers, detection_snr * noise * band.noise_gain(), 1 / band.answer(bead_sigma));
  std::vector<double> heights;
  for (const DetectedBead& bead : beads) heights.push_back(bead.brightness);
  // beads of a tenth of a bright one's light are spurious more often than not: halos, bleed-through, dust
  const double dimmest = 0.1 * quantile(heights, 0.9);
  std::erase_if(beads, [&](const DetectedBead& bead) { return bead.brightness < dimmest; });
  constexpr int kRounds = 4;
  beads = fitted_spots(plane, std::move(beads), bead_sigma, kRounds, threads);
  std::erase_if(beads, [&](const DetectedBead& b) {
    return b.position_px.x < 0 || b.position_px.y < 0 || b.position_px.x > plane.width - 1 ||
           b.position_px.y > plane.height - 1;
  });
  return beads;
}

std::vector<DetectedBead> detect_beads(const Image& image, double detection_snr, int threads) {
  const Plane rough = without_background(image, 12);
  const double bead_sigma = bead_sigma_of(rough);
  if (!(bead_sigma > 0)) return {};
  const Plane plane = without_background(image, background_sigma(bead_sigma));
  return find_spots(plane, bead_sigma, noise_of(plane), detection_snr, threads);
}

}  // namespace mbtfm::segment
