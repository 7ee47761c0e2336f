/// A pair of bead images whose displacement is known exactly.
#pragma once

#include "pipeline/contract/geometry.h"
#include "segment/beads/track.h"
#include "segment/images/image.h"
#include "tests/support/test.h"

namespace mbtfm::test {

/// A peak like that of a focal adhesion: what a patch of radius `radius` of a half-space (nu = 0.49) does when pulled
/// along `pull`, softened inside of it:
///
///   u = a / sqrt(r² + a²) [ (1−nu) p + nu (p·d) d / (r² + a²) ] / (1−nu),   |u| = |p| at its centre.
struct Peak {
  Vec2 centre, pull;
  double radius = 1;
  double reach = 1e9;  ///< of a gel so thin: beyond it hardly anything moves, as a Gaussian of it
};

/// @param depth  below the surface, px
inline Vec2 displacement(const std::vector<Peak>& peaks, Vec2 point, double depth = 0) {
  constexpr double kPoisson = 0.49;
  Vec2 sum;
  for (const Peak& peak : peaks) {
    const Vec2 d = point - peak.centre;
    const double squared = dot(d, d) + (peak.radius + depth) * (peak.radius + depth);
    const double scale =
        peak.radius / std::sqrt(squared) / (1 - kPoisson) * std::exp(-0.5 * dot(d, d) / (peak.reach * peak.reach));
    sum += scale * ((1 - kPoisson) * peak.pull + kPoisson * dot(peak.pull, d) / squared * d);
  }
  return sum;
}

/// Adhesions on a ring that pull towards its centre, without a net force; one of them moves `largest` px.
/// @param size  of the adhesions
/// @param n  up to ten
/// @param reach  of the gel, in radii
inline std::vector<Peak> ring_of_adhesions(double width, double largest, double size = 1, int n = 10,
                                           double reach = 1e9) {
  const double strengths[] = {1.0, 0.35, 0.6, 0.25, 0.8, 0.45, 0.3, 0.55, 0.4, 0.7};
  const double radii[] = {6.5, 4, 5, 4, 6, 5, 4, 5, 4.5, 6};
  std::vector<Peak> peaks;
  Vec2 net;
  for (int k = 0; k < n; ++k) {
    const double angle = 2 * std::numbers::pi * (k + 0.3 * strengths[k]) / n;
    const Vec2 out{std::cos(angle), std::sin(angle)};
    const Vec2 centre = Vec2{0.5 * width, 0.5 * width} + (0.2 + 0.12 * radii[k] / 6) * width * out;
    peaks.push_back({centre, -strengths[k] * largest * out, size * radii[k], reach * size * radii[k]});
    net += peaks.back().radius * peaks.back().pull;  // force goes with displacement times radius
  }
  for (Peak& peak : peaks) peak.pull = peak.pull - (1.0 / n / peak.radius) * net;
  double peak_length = 0;
  for (const Peak& peak : peaks) peak_length = std::max(peak_length, norm(displacement(peaks, peak.centre)));
  for (Peak& peak : peaks) peak.pull = largest / peak_length * peak.pull;
  return peaks;
}

/// Largest change of the true displacement over a step of half a pixel to either side, per pixel.
inline double steepness(const std::vector<Peak>& peaks, Vec2 at) {
  const Vec2 along_x = displacement(peaks, at + Vec2{0.5, 0}) - displacement(peaks, at - Vec2{0.5, 0});
  const Vec2 along_y = displacement(peaks, at + Vec2{0, 0.5}) - displacement(peaks, at - Vec2{0, 0.5});
  return std::max(norm(along_x), norm(along_y));
}

/// The same with adhesions of the size that strains the gel by `strain` at most.
inline std::vector<Peak> ring_of_strain(double width, double largest, double strain, int n = 10, double reach = 1e9) {
  const auto of_size = [&](double size) { return ring_of_adhesions(width, largest, size, n, reach); };
  const auto steepest = [&](const std::vector<Peak>& peaks) {
    double most = 0;
    for (const Peak& peak : peaks)
      for (int j = -8; j <= 8; ++j)
        for (int i = -8; i <= 8; ++i)
          most = std::max(most, steepness(peaks, peak.centre + 0.25 * peak.radius * Vec2{1.0 * i, 1.0 * j}));
    return most;
  };
  double small = 0.2, large = 20;  // the larger, the less strain
  for (int step = 0; step < 20; ++step) {
    const double middle = std::sqrt(small * large);
    (steepest(of_size(middle)) > strain ? small : large) = middle;
  }
  return of_size(large);
}

/// How beads and camera look. Lengths in px, light in electrons.
struct BeadScene {
  int width = 512;
  int n_beads = 5242;
  double bead_sigma = 1.3;
  double bead_aspect = 1;          ///< height over width of a bead's picture, of the same light
  double brightness = 1500;        ///< median peak of a bead
  double brightness_spread = 0.4;  ///< of its logarithm
  double background = 150;
  double read_noise = 5;
  double jitter = 0;        ///< sd of a bead's own random step between the images
  double lost = 0;          ///< share of beads that only one of the images shows, in each
  double uneven_light = 0;  ///< relative fall of the light towards a corner, another one in each image
  double gain = 1;          ///< of the stressed image over the relaxed one
  double offset = 0;
  double turn_rad = 0;     ///< of the stressed image about its centre, before the drift
  double growth = 0;       ///< relative, of the same
  double depth = 0;        ///< beads lie in focus and as far below; what they do there is less
  double focal_depth = 3;  ///< so far off focus a bead is wider by sqrt 2
  double defocus = 1;      ///< width of a bead in the stressed image over that in the relaxed one, of the same light
  Vec2 drift{};
  std::uint64_t seed = 1;
};

/// With the places of the relaxed picture, where the truth of a drawn pair is.
inline beads::TrackParameters in_relaxed_frame(beads::TrackParameters parameters = {}) {
  parameters.cell_with = CellWith::relaxed;
  return parameters;
}

struct BeadPair {
  images::Image relaxed, stressed;
  std::vector<Vec2> positions;      ///< of the beads in the relaxed state: px, 0 at the centre of the first pixel
  std::vector<Vec2> displacements;  ///< stressed minus relaxed, without drift
};

inline void add_bead(images::Image& image, Vec2 at, double peak, double sigma, double aspect = 1) {
  const double wide = sigma / std::sqrt(aspect), high = sigma * std::sqrt(aspect);
  const int reach = static_cast<int>(std::ceil(5 * std::max(wide, high)));
  const int i0 = static_cast<int>(std::lround(at.x)), j0 = static_cast<int>(std::lround(at.y));
  for (int j = std::max(0, j0 - reach); j <= std::min(image.height - 1, j0 + reach); ++j)
    for (int i = std::max(0, i0 - reach); i <= std::min(image.width - 1, i0 + reach); ++i) {
      const double squared = std::pow((i - at.x) / wide, 2) + std::pow((j - at.y) / high, 2);
      image.at(i, j) += static_cast<float>(peak * std::exp(-0.5 * squared));
    }
}

/// Draw the pair. Beads fill a margin around the picture too, so that some come in and some leave.
inline BeadPair draw_bead_pair(const std::vector<Peak>& peaks, const BeadScene& scene) {
  std::mt19937_64 random(scene.seed);
  std::uniform_real_distribution<double> uniform(0, 1);
  std::normal_distribution<double> normal;
  BeadPair pair;
  for (images::Image* image : {&pair.relaxed, &pair.stressed}) {
    image->width = image->height = scene.width;
    image->pixels.assign(static_cast<std::size_t>(scene.width) * scene.width, 0.0f);
    image->full_scale = 65535;
  }
  constexpr double kMargin = 20;
  const double side = scene.width + 2 * kMargin;
  const int n_drawn = static_cast<int>(std::lround(scene.n_beads * side * side / (1.0 * scene.width * scene.width)));
  for (int b = 0; b < n_drawn; ++b) {
    const Vec2 at{uniform(random) * side - kMargin - 0.5, uniform(random) * side - kMargin - 0.5};
    const double peak = scene.brightness * std::exp(scene.brightness_spread * normal(random));
    const Vec2 step{scene.jitter * normal(random), scene.jitter * normal(random)};
    const double depth = scene.depth > 0 ? scene.depth * uniform(random) : 0;
    const double wider = std::hypot(1.0, depth / scene.focal_depth);
    const Vec2 moved = displacement(peaks, at, depth) + step;
    const bool is_in_relaxed = uniform(random) >= scene.lost;
    const bool is_in_stressed = uniform(random) >= scene.lost;
    const auto add = [&](images::Image& image, Vec2 place, double by) {
      add_bead(image, place, peak / (by * by), by * scene.bead_sigma, scene.bead_aspect);
    };
    if (is_in_relaxed) add(pair.relaxed, at, wider);
    const Vec2 centre{0.5 * (scene.width - 1), 0.5 * (scene.width - 1)}, d = at + moved - centre;
    const double larger = 1 + scene.growth, c = larger * std::cos(scene.turn_rad),
                 s = larger * std::sin(scene.turn_rad);
    const Vec2 there = centre + scene.drift + Vec2{c * d.x - s * d.y, s * d.x + c * d.y};
    if (is_in_stressed) add(pair.stressed, there, wider * scene.defocus);
    const bool is_inside = at.x >= 0 && at.y >= 0 && at.x <= scene.width - 1 && at.y <= scene.width - 1;
    if (!is_inside || !is_in_relaxed || !is_in_stressed) continue;
    pair.positions.push_back(at);
    pair.displacements.push_back(moved);
  }
  for (images::Image* image : {&pair.relaxed, &pair.stressed}) {
    const bool is_stressed = image == &pair.stressed;
    for (int j = 0; j < scene.width; ++j)
      for (int i = 0; i < scene.width; ++i) {
        const double along = (is_stressed ? i : scene.width - i) / (1.0 * scene.width);
        const double light = (is_stressed ? scene.gain : 1) * (1 - scene.uneven_light * along);
        const double mean = light * (image->at(i, j) + scene.background);
        const double counted = static_cast<double>(std::poisson_distribution<int>(mean)(random));
        image->at(i, j) = static_cast<float>(std::max(
            0.0, std::round(counted + scene.read_noise * normal(random) + 100 + (is_stressed ? scene.offset : 0))));
      }
  }
  return pair;
}

}  // namespace mbtfm::test
