#include "segment/stacks/spots.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mbtfm::stacks {
namespace {

/// The value at and above which voxels are cut off; infinity: none are.
float limit_of(const std::vector<images::Image>& slices, double full_scale) {
  float largest = 0;
  for (const images::Image& slice : slices) largest = std::max(largest, std::ranges::max(slice.pixels));
  if (full_scale > 0 && largest >= full_scale) return static_cast<float>(full_scale);
  // detectors of 12 bits in files of 16: voxels pile up at the limit, where others thin out towards their largest
  std::size_t at_limit = 0, just_below = 0;
  for (const images::Image& slice : slices) {
    for (const float v : slice.pixels) {
      at_limit += v == largest;
      just_below += v < largest && v > 0.99f * largest;
    }
  }
  constexpr std::size_t kMany = 50;
  return at_limit >= kMany && at_limit > 3 * just_below ? largest : std::numeric_limits<float>::infinity();
}

}  // namespace

Volume volume_of(std::vector<images::Image> slices) {
  Volume volume;
  if (slices.empty()) return volume;
  volume.width = slices.front().width, volume.height = slices.front().height;
  volume.depth = static_cast<int>(slices.size());
  volume.full_scale = slices.front().full_scale;
  const float limit = limit_of(slices, volume.full_scale);
  const std::size_t in_slice = slices.front().pixels.size();
  volume.values.reserve(in_slice * slices.size());
  if (std::isfinite(limit)) volume.is_saturated.resize(in_slice * slices.size());
  for (images::Image& slice : slices) {
    for (const float value : slice.pixels) {
      if (value >= limit) volume.is_saturated[volume.values.size()] = true;
      volume.values.push_back(value);
    }
    slice.pixels = {};
  }
  return volume;
}

}  // namespace mbtfm::stacks
