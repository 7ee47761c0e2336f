#include "segment/beads/measure.h"

#include <algorithm>
#include <cmath>

namespace mbtfm::beads {
namespace {

/// Around a place, means with the weights of a Gaussian about it.
struct Moments {
  double light = 0, even = 0, diagonal = 0;  ///< of I, (x² − y²) I, 2xy I
};

Moments around(const Plane& plane, Vec2 place, double sigma) {
  const int reach = static_cast<int>(std::ceil(3 * sigma));
  const int ci = static_cast<int>(std::lround(place.x)), cj = static_cast<int>(std::lround(place.y));
  Moments sum;
  double weights = 0;
  for (int j = std::max(0, cj - reach); j <= std::min(plane.height - 1, cj + reach); ++j) {
    for (int i = std::max(0, ci - reach); i <= std::min(plane.width - 1, ci + reach); ++i) {
      const Vec2 d{i - place.x, j - place.y};
      const double weight = std::exp(-0.5 * dot(d, d) / (sigma * sigma)), light = weight * plane.at(i, j);
      sum.light += light;
      sum.even += light * (d.x * d.x - d.y * d.y);
      sum.diagonal += light * 2 * d.x * d.y;
      weights += weight;
    }
  }
  if (!(weights > 0)) return {};
  return {sum.light / weights, sum.even / weights, sum.diagonal / weights};
}

/// Of a bead, or of all, in one image.
struct Light {
  double near = 0, wide = 0;
  Vec2 shape;  ///< even, diagonal
  double ratio() const { return near / wide; }
  Light& operator+=(const Light& more) {
    near += more.near, wide += more.wide, shape += more.shape;
    return *this;
  }
};

}  // namespace

BeadSizes sizes_of(const Scene& scene, const std::vector<Track>& tracks) {
  const double s1 = scene.bead_sigma(), s2 = 2 * s1;
  std::vector<Light> relaxed(tracks.size()), stressed(tracks.size());
  for_each_bead(scene, [&](int k) {
    if (!tracks[k].is_good()) return;
    const auto light = [&](const Plane& plane, Vec2 place) {
      const Moments near = around(plane, place, s1);
      return Light{near.light, around(plane, place, s2).light, {near.even, near.diagonal}};
    };
    relaxed[k] = light(scene.relaxed->image.plane, scene.position(k));
    stressed[k] = light(scene.stressed.image.plane, scene.position(k) + tracks[k].found.motion.u);
  });
  Light of_relaxed, of_stressed;
  for (const Light& bead : relaxed) of_relaxed += bead;
  for (const Light& bead : stressed) of_stressed += bead;
  const auto squared_size = [&](double ratio) { return (s2 * s2 - ratio * s1 * s1) / (ratio - 1); };
  const double p = of_relaxed.ratio(), q = of_stressed.ratio();
  if (!(p > 1) || !(q > 1) || !(squared_size(p) > 0) || !(squared_size(q) > 0)) return {};
  // d ln s = slope dR
  const auto slope = [&](double ratio) {
    return 0.5 * (s1 * s1 - s2 * s2) / ((ratio - 1) * (ratio - 1)) / squared_size(ratio);
  };
  // half the relative difference of the squared sizes is the ellipticity: this, by the sum of Q over that of A − B
  const auto ellipticity_by_shape = [&](const Light& all) {
    const double squared = squared_size(all.ratio()), wider = s1 * s1 + squared;
    return (s2 * s2 - s1 * s1) / (squared + s2 * s2) * wider * wider / std::pow(s1, 4) / (2 * squared) /
           (all.near - all.wide);
  };
  const double e_relaxed = ellipticity_by_shape(of_relaxed), e_stressed = ellipticity_by_shape(of_stressed);
  double variance = 0, shape_variance = 0;
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    const double share = slope(q) * (stressed[k].near - q * stressed[k].wide) / of_stressed.wide -
                         slope(p) * (relaxed[k].near - p * relaxed[k].wide) / of_relaxed.wide;
    variance += share * share;
    const Vec2 shape = 0.5 * (e_relaxed * relaxed[k].shape + e_stressed * stressed[k].shape);
    shape_variance += 0.5 * dot(shape, shape);  // of either component
  }
  const double ratio = std::sqrt(squared_size(q) / squared_size(p));
  const Vec2 shape = 0.5 * (e_relaxed * of_relaxed.shape + e_stressed * of_stressed.shape);
  // within 3 degrees of an axis; of each image's ellipticity some per cent are the beads' arrangement
  constexpr double kAlong = 0.105, kAlike = 0.02;
  const Vec2 difference = e_stressed * of_stressed.shape - e_relaxed * of_relaxed.shape;
  const double sigma = std::sqrt(shape_variance);
  const double e = std::min(0.9, norm(shape));  // the formula is linear: beyond it says no more than "much"
  return {.ratio = ratio,
          .sigma = ratio * std::sqrt(variance),
          .elongation = std::sqrt((1 + e) / (1 - e)),
          .elongation_sigma = sigma,  // d sqrt((1 + e)/(1 − e)) = de to first order
          .angle_rad = 0.5 * std::atan2(shape.y, shape.x),
          .is_of_pixels = norm(difference) < kAlike + 3 * 2 * sigma &&  // twice: of a difference, not of a mean
                          std::abs(shape.y) < kAlong * std::abs(shape.x) + 2 * sigma};
}

}  // namespace mbtfm::beads
