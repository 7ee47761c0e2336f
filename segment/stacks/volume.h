/// Inside of the tracker of beads in stacks: grey values in space.
#pragma once

#include <cstdint>
#include <vector>

#include "segment/images/image.h"

namespace mbtfm::stacks {

/// Grey values, slice by slice, row by row. Coordinates are voxels, 0 at the centre of the first.
struct Volume {
  int width = 0, height = 0, depth = 0;
  std::vector<float> values;
  std::vector<bool> is_saturated;  ///< by voxel; empty: none
  double full_scale = 0;           ///< at which the detector saturates; 0: none

  std::size_t index(int i, int j, int k) const {
    return (static_cast<std::size_t>(k) * height + j) * width + static_cast<std::size_t>(i);
  }
  const float* row(int j, int k) const { return values.data() + index(0, j, k); }
  float* row(int j, int k) { return values.data() + index(0, j, k); }
  float at(int i, int j, int k) const { return values[index(i, j, k)]; }
};

/// The slices in this order; they are let go of one by one, so that the stack is in memory once. Voxels at the
/// detector's limit are marked: that of its numbers, or one below them that many voxels share.
Volume volume_of(std::vector<images::Image> slices);

/// Where a coordinate lies that is mirrored in the first and last voxel.
inline int mirrored(int at, int n) {
  if (n == 1) return 0;
  const int period = 2 * (n - 1), m = ((at % period) + period) % period;
  return m < n ? m : period - m;
}

}  // namespace mbtfm::stacks
