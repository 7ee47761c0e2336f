/// Beads in a stack of slices, found to a fraction of a voxel.
#pragma once

#include <vector>

#include "segment/images/image.h"
#include "segment/stacks/spots.h"

namespace mbtfm::stacks {

/// The beads of a stack.
struct Detection {
  int width = 0, height = 0, depth = 0;
  std::vector<Spot> spots;
  SpotShape shape;
  Noise noise;
  double share_saturated = 0;  ///< of the voxels

  Widths widths_in_the_middle() const { return shape.at({0.5 * width, 0.5 * height, 0.5 * depth}); }
};

/// Find the beads.
///
/// 1. Light that varies slowly is taken off each slice; the noise of each is measured (Immerkaer, CVIU 64:300, 1996).
/// 2. The widths of the beads' pictures follow from the autocorrelation, whose lag zero alone carries the noise.
/// 3. Candidates are the maxima of a band-pass of these widths.
/// 4. A Gaussian is fitted to each together with those that touch it, weighed by the noise of each voxel. Its widths
/// are
///    those of the bright, lonely beads near it in place and depth, fitted one by one.
/// 5. Candidates of what the fit leaves are those that others hid.
///
/// Standard errors are those of the weighted least squares, with what the joint fit costs.
/// @throws beads::NotFollowed where the stack shows no beads
/// @param which  "relaxed" or "stressed", for errors
Detection detect(std::vector<images::Image> slices, double detection_snr, const char* which, int threads);

}  // namespace mbtfm::stacks
