/// Inside of the bead tracker: bright spots of a known size, both images made ready, and the sizes that everything
/// follows from.
#pragma once

#include <memory>
#include <optional>

#include "pipeline/numerics/parallel.h"
#include "segment/beads/plane.h"
#include "segment/beads/registration.h"
#include "segment/beads/track.h"

namespace mbtfm::beads {

/// Spots of Gaussian sigma `bead_sigma` (px) in an image without its background.
std::vector<DetectedBead> find_spots(const Plane& plane, double bead_sigma, double noise, double detection_snr,
                                     int threads);

/// Spots that are about known, the places and heights of the `wanted` ones (indices) fitted in at most so many rounds,
/// each with the others' pictures taken away.
std::vector<DetectedBead> fitted_spots(const Plane& plane, std::vector<DetectedBead> spots, std::vector<int> wanted,
                                       double bead_sigma, int rounds, int threads);

/// What is as wide as a spot: the difference of two Gaussian averages, which spots are looked for in.
Plane spot_light(const Plane& plane, double bead_sigma);

/// Smoothing width (px) of the background for beads of that size: wide enough to leave a bead 95 % of its height.
double background_sigma(double bead_sigma);

/// One image and its beads.
struct Side {
  SmoothImage image;
  double noise = 0;  ///< standard deviation of a pixel
  double bead_sigma = 0;
  double spacing = 0;  ///< mean distance of beads: 1/sqrt(density)
  std::vector<DetectedBead> beads;
  std::vector<Vec2> positions;
  Neighbours neighbours;  ///< of positions
  /// Each bead's nearest others within 3.5 mean distances, the nearest first: the disc holds 38, a clump more.
  std::vector<std::vector<int>> around;
};
/// Without `around`.
/// @throws NotFollowed for `which` image where it shows fewer beads than a field needs
Side side_of(const images::Image& image, double bead_sigma, double detection_snr, const char* which, int threads);
std::vector<std::vector<int>> beads_around(const Side& side, int threads);

struct Scene {
  std::shared_ptr<const Side> relaxed;
  Side stressed;
  Window wide;    ///< finds a bead: about three beads weigh in it
  Window narrow;  ///< measures it: the bead alone
  int threads = 1;
  double bead_sigma() const { return relaxed->bead_sigma; }
  double spacing() const { return relaxed->spacing; }
  Vec2 position(int bead) const { return relaxed->positions[bead]; }
  int n_beads() const { return static_cast<int>(relaxed->positions.size()); }
};
Scene scene_of(std::shared_ptr<const Side> relaxed, Side stressed, int threads);

/// A bead's track; it counts as long as it has no flag.
struct Track {
  Registered found;
  TrackFlag flag = TrackFlag::no_partner;
  std::optional<Others> others = {};  ///< whose pictures were taken away
  bool is_good() const { return flag == TrackFlag::none; }
};

/// Call body(k) for each bead of the relaxed image.
template <class Body>
void for_each_bead(const Scene& scene, const Body& body) {
  constexpr int kChunk = 32;
  const int n = scene.n_beads();
  numerics::parallel_for((n + kChunk - 1) / kChunk, scene.threads, [&](int chunk) {
    for (int k = chunk * kChunk; k < std::min(n, (chunk + 1) * kChunk); ++k) body(k);
  });
}

/// The n good tracks nearest to a bead and at least `gap` px from it.
std::vector<int> good_around(const Scene& scene, const std::vector<Track>& tracks, int bead, int n, double gap = 0);

int n_good(const std::vector<Track>& tracks);

std::vector<Motion> motions_of(const std::vector<Track>& tracks);

}  // namespace mbtfm::beads
