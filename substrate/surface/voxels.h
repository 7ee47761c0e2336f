/// Where the gel begins in a stack of masks.
#pragma once

#include <cstdint>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm::surface {

/// Slices of n_x x n_y pixels, slice 0 at z = 0, the next ones deeper.
struct VoxelStack {
  int n_x = 0, n_y = 0, n_z = 0;
  double pixel_um = 0, step_um = 0;
  std::vector<float> share;  ///< of gel, 0 to 1; x fastest, then y, then the slice
};

struct VoxelPoints {
  std::vector<Vec3> points_um;     ///< of the surface: one at the middle of each column in which the gel begins
  double sigma_um = 0;             ///< of z: even, half a slice to each side at most
  std::int64_t n_voxels_left_out;  ///< of specks outside of the gel, and of bubbles in it
};

/// @throws InvalidData where the gel overhangs by more than two slices, by place, or begins within the stack in less
///         than half of the columns
VoxelPoints points_of_masks(const VoxelStack& stack);

}  // namespace mbtfm::surface
