/// Bead images as no bead tracker likes them: weak, dense, blurred, on a mottled ground, in eight bits.
#pragma once

#include "segment/beads/plane.h"
#include "tests/support/bead_pair.h"

namespace mbtfm::test {

struct Weakness {
  double mottle = 0;        ///< sd of the ground, in the image's units; another ground in each image
  double mottle_sigma = 8;  ///< px, of its spots
  double levels = 0;        ///< grey levels that the image's range has left; 0: as it is
};

/// Spots of light that are no beads.
inline std::vector<float> mottled_ground(const images::Image& image, const Weakness& weakness, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<float> normal;
  beads::Plane ground{image.width, image.height, std::vector<float>(image.pixels.size())};
  for (float& value : ground.values) value = normal(random);
  ground = beads::blurred(ground, weakness.mottle_sigma);
  // white noise of 1 that is averaged over a Gaussian keeps 1/(2 sqrt(pi) sigma) of its standard deviation
  const double scale = weakness.mottle * 2 * std::sqrt(std::numbers::pi) * weakness.mottle_sigma;
  for (float& value : ground.values) value *= static_cast<float>(scale);
  return ground.values;
}

inline void weaken(images::Image& image, const Weakness& weakness, std::uint64_t seed) {
  const std::vector<float> ground = mottled_ground(image, weakness, seed);
  for (std::size_t k = 0; k < ground.size(); ++k) image.pixels[k] = std::max(0.0f, image.pixels[k] + ground[k]);
  if (!(weakness.levels > 0)) return;
  const auto [low, high] = std::minmax_element(image.pixels.begin(), image.pixels.end());
  const float first = *low, step = static_cast<float>((*high - *low) / weakness.levels);
  for (float& value : image.pixels) value = std::round((value - first) / step);
}

inline BeadPair weakened(BeadPair pair, const Weakness& weakness, std::uint64_t seed) {
  weaken(pair.relaxed, weakness, 2 * seed);
  weaken(pair.stressed, weakness, 2 * seed + 1);
  return pair;
}

}  // namespace mbtfm::test
