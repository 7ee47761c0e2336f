#include "segment/beads/scene.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "pipeline/contract/errors.h"
#include "segment/beads/beads.h"

namespace mbtfm::beads {

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
  // 1.6 bead sigmas: four fifths of what a bead's flanks tell of its place, and little of its neighbours'
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
