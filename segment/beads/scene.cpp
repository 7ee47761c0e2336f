#include "segment/beads/scene.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <numeric>
#include <opencv2/core.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::beads {
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

BandPass band_for(double bead_sigma) { return {0.8 * bead_sigma, 1.6 * bead_sigma}; }

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

std::vector<DetectedBead> peaks(const Plane& band, double threshold, double height_by_answer) {
  std::vector<DetectedBead> result;
  for (int j = 1; j + 1 < band.height; ++j) {
    for (int i = 1; i + 1 < band.width; ++i) {
      if (band.at(i, j) < threshold || !is_peak(band, i, j)) continue;
      result.push_back({{i + parabola_vertex(band.at(i - 1, j), band.at(i, j), band.at(i + 1, j)),
                         j + parabola_vertex(band.at(i, j - 1), band.at(i, j), band.at(i, j + 1))},
                        band.at(i, j) * height_by_answer});
    }
  }
  return result;
}

/// exp(−d²/2s²) on the pixels from `first` on.
std::vector<float> profile(double centre, int first, int n, double sigma) {
  std::vector<float> result(static_cast<std::size_t>(n));
  const float scale = static_cast<float>(1 / sigma), start = static_cast<float>(first - centre);
  for (int k = 0; k < n; ++k) {
    const float d = scale * (start + static_cast<float>(k));
    result[k] = std::exp(-0.5f * d * d);
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

/// Add `share` times a bead's picture.
void add_picture(Plane& plane, const DetectedBead& bead, double sigma, double share) {
  const Box box = box_around(plane, bead.position_px, static_cast<int>(std::ceil(4 * sigma)));  // 3e-4 is left there
  const int n = box.right - box.left + 1, m = box.bottom - box.top + 1;
  if (n <= 0 || m <= 0) return;
  const std::vector<float> x = profile(bead.position_px.x, box.left, n, sigma);
  const std::vector<float> y = profile(bead.position_px.y, box.top, m, sigma);
  for (int j = 0; j < m; ++j) {
    float* row = plane.values.data() + static_cast<std::size_t>(box.top + j) * plane.width + box.left;
    const float height = static_cast<float>(share * bead.brightness) * y[j];
    for (int i = 0; i < n; ++i) row[i] += height * x[i];
  }
}

/// Along one axis of a spot's box: the spot S, S d (d in bead sigmas) and 1, each times the weight W; and sums of
/// their products, of which those over the box are products, since the box, the spot and the weight are.
struct Axis {
  std::vector<float> spot, slope, one;
  double w = 0, s = 0, sd = 0, ss = 0, ssd = 0, ssdd = 0;  ///< of W, W S, W S d, W S², W S² d, W S² d²
  Axis(double centre, int first, int n, double sigma) : spot(n), slope(n), one(profile(centre, first, n, 1.5 * sigma)) {
    const std::vector<float> shape = profile(centre, first, n, sigma);
    for (int k = 0; k < n; ++k) {
      const float d = static_cast<float>((first + k - centre) / sigma);
      spot[k] = one[k] * shape[k], slope[k] = spot[k] * d;
      w += one[k], s += spot[k], sd += slope[k];
      ss += spot[k] * shape[k], ssd += slope[k] * shape[k], ssdd += slope[k] * shape[k] * d;
    }
  }
};

/// One Gauss–Newton step of height, place and level of a spot on what the spots leave of the plane, weighted by a
/// Gaussian of 1.5 bead sigmas. Steps are held to half a pixel: touching beads are fitted in turns.
DetectedBead improved(const DetectedBead& bead, const Plane& rest, double sigma) {
  const Box box = box_around(rest, bead.position_px, static_cast<int>(std::ceil(2.5 * sigma)));
  const int n = box.right - box.left + 1, m = box.bottom - box.top + 1;
  if (n <= 0 || m <= 0 || !(bead.brightness > 0)) return bead;
  const Axis x(bead.position_px.x, box.left, n, sigma), y(bead.position_px.y, box.top, m, sigma);
  // rows: height, place along x, along y (in units of sigma/height), level
  const double hx = x.ssd * y.ss, hy = x.ss * y.ssd, xy = x.ssd * y.ssd, hl = x.s * y.s, xl = x.sd * y.s,
               yl = x.s * y.sd;
  const cv::Matx44d normal(x.ss * y.ss, hx, hy, hl, hx, x.ssdd * y.ss, xy, xl, hy, xy, x.ss * y.ssdd, yl, hl, xl, yl,
                           x.w * y.w);
  cv::Vec4d right;
  for (int j = 0; j < m; ++j) {
    const float* row = rest.row(box.top + j) + box.left;
    float spot = 0, slope = 0, one = 0;
    for (int i = 0; i < n; ++i) spot += x.spot[i] * row[i], slope += x.slope[i] * row[i], one += x.one[i] * row[i];
    right[0] += y.spot[j] * spot, right[1] += y.spot[j] * slope, right[2] += y.slope[j] * spot;
    right[3] += y.one[j] * one;
  }
  bool is_regular = false;
  const cv::Vec4d change = normal.inv(cv::DECOMP_CHOLESKY, &is_regular) * right;
  if (!is_regular) return bead;
  DetectedBead result = bead;
  const double to_px = sigma / bead.brightness;
  result.position_px.x += std::clamp(change[1] * to_px, -0.5, 0.5);
  result.position_px.y += std::clamp(change[2] * to_px, -0.5, 0.5);
  result.brightness = std::clamp(bead.brightness + change[0], 0.5 * bead.brightness, 2 * bead.brightness);
  return result;
}

}  // namespace

Plane spot_light(const Plane& plane, double bead_sigma) { return filtered(plane, band_for(bead_sigma)); }

double background_sigma(double bead_sigma) { return std::max(6 * bead_sigma, 8.0); }

std::vector<DetectedBead> fitted_spots(const Plane& plane, std::vector<DetectedBead> spots, std::vector<int> wanted,
                                       double bead_sigma, int rounds, int threads) {
  Plane rest = plane;
  for (const DetectedBead& spot : spots) add_picture(rest, spot, bead_sigma, -1);
  for (int round = 0; round < rounds && !wanted.empty(); ++round) {
    std::vector<DetectedBead> next(wanted.size());
    in_strips(static_cast<int>(wanted.size()), threads, [&](int from, int to) {
      for (int k = from; k < to; ++k) next[k] = improved(spots[wanted[k]], rest, bead_sigma);
    });
    std::vector<int> unsettled;
    for (std::size_t k = 0; k < wanted.size(); ++k) {
      DetectedBead& spot = spots[wanted[k]];
      const double step = norm(next[k].position_px - spot.position_px);
      const double brighter = std::abs(next[k].brightness - spot.brightness);
      constexpr double kSettled = 0.01;  // px, and of the brightness: a tenth of what a spot is known to
      if (!(step < kSettled && brighter < kSettled * spot.brightness)) unsettled.push_back(wanted[k]);
      if (!(step < bead_sigma)) continue;  // a fit that runs away from its maximum is not believed
      add_picture(rest, spot, bead_sigma, 1);
      spot = next[k];
      add_picture(rest, spot, bead_sigma, -1);
    }
    wanted = std::move(unsettled);
  }
  return spots;
}

std::vector<DetectedBead> find_spots(const Plane& plane, double bead_sigma, double noise, double detection_snr,
                                     int threads) {
  const BandPass band = band_for(bead_sigma);
  const Plane answers = filtered(plane, band);
  std::vector<DetectedBead> beads =
      peaks(answers, detection_snr * noise * band.noise_gain(), 1 / band.answer(bead_sigma));
  std::vector<double> heights;
  for (const DetectedBead& bead : beads) heights.push_back(bead.brightness);
  // beads of a tenth of a bright one's light are spurious more often than not: halos, bleed-through, dust
  const double dimmest = 0.1 * numerics::quantile(heights, 0.9);
  std::erase_if(beads, [&](const DetectedBead& bead) { return bead.brightness < dimmest; });
  constexpr int kRounds = 4;
  std::vector<int> all(beads.size());
  std::iota(all.begin(), all.end(), 0);
  beads = fitted_spots(plane, std::move(beads), std::move(all), bead_sigma, kRounds, threads);
  std::erase_if(beads, [&](const DetectedBead& b) {
    return b.position_px.x < 0 || b.position_px.y < 0 || b.position_px.x > plane.width - 1 ||
           b.position_px.y > plane.height - 1;
  });
  return beads;
}

std::vector<DetectedBead> detect_beads(const images::Image& image, double detection_snr, int threads) {
  const Plane rough = without_background(image, 12);
  const double bead_sigma = bead_sigma_of(rough);
  if (!(bead_sigma > 0)) return {};
  const Plane plane = without_background(image, background_sigma(bead_sigma));
  return find_spots(plane, bead_sigma, noise_of(plane), detection_snr, threads);
}

Side side_of(const images::Image& image, double bead_sigma, double detection_snr, const char* which, int threads) {
  const NotFollowed no_beads(std::string("the ") + which + " image", "bright beads on a darker ground", "none");
  if (!(bead_sigma > 0)) throw no_beads;
  Side side;
  side.bead_sigma = bead_sigma;
  side.image = smooth_image(without_background(image, background_sigma(bead_sigma)), threads);
  side.noise = noise_of(side.image.plane);
  side.beads = find_spots(side.image.plane, bead_sigma, side.noise, detection_snr, threads);
  constexpr std::size_t kFewest = 8;  // an affine map and a scatter about it take six beads
  if (side.beads.empty()) throw no_beads;
  if (side.beads.size() < kFewest) {
    throw NotFollowed(no_beads.element, std::to_string(kFewest) + " beads at least", std::to_string(side.beads.size()));
  }
  for (const DetectedBead& bead : side.beads) side.positions.push_back(bead.position_px);
  const double n_beads = static_cast<double>(side.beads.size());
  side.spacing = std::sqrt(image.width * static_cast<double>(image.height) / n_beads);
  side.neighbours = Neighbours(side.positions, std::max(4.0, side.spacing));
  return side;
}

std::vector<std::vector<int>> beads_around(const Side& side, int threads) {
  constexpr int kMost = 60;
  std::vector<std::vector<int>> around(side.beads.size());
  in_strips(static_cast<int>(around.size()), threads, [&](int from, int to) {
    for (int k = from; k < to; ++k) {
      around[k] = side.neighbours.within(side.positions[k], 3.5 * side.spacing, kMost);
      std::erase(around[k], k);
    }
  });
  return around;
}

Scene scene_of(std::shared_ptr<const Side> relaxed, Side stressed, int threads) {
  Scene scene{.relaxed = std::move(relaxed), .stressed = std::move(stressed), .wide = {}, .narrow = {}};
  scene.threads = threads;
  const double noise = std::hypot(scene.relaxed->noise, scene.stressed.noise);
  // A Gaussian weight of sigma s weighs the area 4 pi s²: three beads in it.
  const double three_beads = scene.spacing() * std::sqrt(0.75 / std::numbers::pi);
  scene.wide = {.sigma = std::clamp(three_beads, 3.5 * scene.bead_sigma(), 5 * scene.bead_sigma()),
                .gradient_sd = 0.3,
                .noise = 2 * noise,
                .max_steps = 15,
                .is_thinned = scene.bead_sigma() > 1.2,  // a chessboard, 1.4 px apart, does not see smaller beads whole
                .settled_px = 0.02};
  // 1.6 bead sigmas: four fifths of what a bead's flanks show of its place, and little of its neighbours'
  scene.narrow = {
      .sigma = 1.6 * scene.bead_sigma(), .gradient_sd = 0.15, .noise = 2 * noise, .max_steps = 15, .settled_px = 2e-3};
  return scene;
}

std::vector<int> good_around(const Scene& scene, const std::vector<Track>& tracks, int bead, int n, double gap) {
  const Vec2 place = scene.position(bead);
  const std::vector<int>& near = scene.relaxed->around[bead];
  std::vector<int> result;
  result.reserve(static_cast<std::size_t>(n));
  const int n_looked_at = std::min(3 * n, static_cast<int>(near.size()));
  for (int at = 0; at < n_looked_at && static_cast<int>(result.size()) < n; ++at) {
    const int k = near[at];
    if (!tracks[k].is_good() || (gap > 0 && norm(scene.position(k) - place) < gap)) continue;
    result.push_back(k);
  }
  return result;
}

int n_good(const std::vector<Track>& tracks) {
  return static_cast<int>(std::count_if(tracks.begin(), tracks.end(), std::mem_fn(&Track::is_good)));
}

std::vector<Motion> motions_of(const std::vector<Track>& tracks) {
  std::vector<Motion> result;
  result.reserve(tracks.size());
  for (const Track& track : tracks) result.push_back(track.found.motion);
  return result;
}

}  // namespace mbtfm::beads
