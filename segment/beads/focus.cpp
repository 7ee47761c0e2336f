#include "segment/beads/focus.h"

#include <algorithm>
#include <cmath>

namespace mbtfm::beads {
namespace {

/// Mean light around a place with the weights of a Gaussian of `sigma` px.
double light_around(const Plane& plane, Vec2 place, double sigma) {
  const int reach = static_cast<int>(std::ceil(3 * sigma));
  const int ci = static_cast<int>(std::lround(place.x)), cj = static_cast<int>(std::lround(place.y));
  double light = 0, weights = 0;
  for (int j = std::max(0, cj - reach); j <= std::min(plane.height - 1, cj + reach); ++j) {
    for (int i = std::max(0, ci - reach); i <= std::min(plane.width - 1, ci + reach); ++i) {
      const Vec2 d{i - place.x, j - place.y};
      const double weight = std::exp(-0.5 * dot(d, d) / (sigma * sigma));
      light += weight * plane.at(i, j);
      weights += weight;
    }
  }
  return weights > 0 ? light / weights : 0;
}

/// Of a bead, or of all, in one image.
struct Light {
  double near = 0, wide = 0;
  double ratio() const { return near / wide; }
};

}  // namespace

SizeRatio size_ratio(const Scene& scene, const std::vector<Track>& tracks) {
  const double s1 = scene.bead_sigma(), s2 = 2 * s1;
  std::vector<Light> relaxed(tracks.size()), stressed(tracks.size());
  for_each_bead(scene, [&](int k) {
    if (!tracks[k].is_good()) return;
    const auto light = [&](const Plane& plane, Vec2 place) {
      return Light{light_around(plane, place, s1), light_around(plane, place, s2)};
    };
    relaxed[k] = light(scene.relaxed->image.plane, scene.position(k));
    stressed[k] = light(scene.stressed.image.plane, scene.position(k) + tracks[k].found.motion.u);
  });
  Light of_relaxed, of_stressed;
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    of_relaxed.near += relaxed[k].near, of_relaxed.wide += relaxed[k].wide;
    of_stressed.near += stressed[k].near, of_stressed.wide += stressed[k].wide;
  }
  const auto squared_size = [&](double ratio) { return (s2 * s2 - ratio * s1 * s1) / (ratio - 1); };
  const double p = of_relaxed.ratio(), q = of_stressed.ratio();
  if (!(p > 1) || !(q > 1) || !(squared_size(p) > 0) || !(squared_size(q) > 0)) return {};
  // d ln s = slope dR
  const auto slope = [&](double ratio) {
    return 0.5 * (s1 * s1 - s2 * s2) / ((ratio - 1) * (ratio - 1)) / squared_size(ratio);
  };
  double variance = 0;
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    const double share = slope(q) * (stressed[k].near - q * stressed[k].wide) / of_stressed.wide -
                         slope(p) * (relaxed[k].near - p * relaxed[k].wide) / of_relaxed.wide;
    variance += share * share;
  }
  const double ratio = std::sqrt(squared_size(q) / squared_size(p));
  return {ratio, ratio * std::sqrt(variance)};
}

}  // namespace mbtfm::beads
