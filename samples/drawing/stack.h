/// Stacks of slices through a gel with beads in it.
#pragma once

#include <cstdint>
#include <vector>

#include "pipeline/contract/geometry.h"
#include "samples/drawing/psf.h"
#include "segment/images/image.h"

namespace mbtfm::drawing {

/// How a stack is recorded, from the first slice into the gel.
struct StackMicroscope {
  Optics optics;
  double pixel_size_um = 0.18;
  int image_size_px = 512;
  int n_slices = 100;
  double z_step_um = 0.5;     ///< of the stage; the focus moves by the ratio of the indices more
  double first_um = 0;        ///< z of the first slice's outer face, in the gel
  double bead_photons = 150;  ///< of a bead in focus, in its brightest voxel
  double bead_brightness_log_sd = 0.25;
  double background_photons = 4;
  double attenuation_um = 150;  ///< depth at which light is down to a third
  double bleached = 0.1;        ///< share of the light that is lost over a stack
  double counts_per_photon = 2;
  double camera_offset = 100;
  double read_noise = 3;  ///< counts

  double focus_step_um() const { return z_step_um * optics.gel_index / optics.immersion_index; }
};

/// A bead as it is seen in one stack.
struct GlowingBead {
  Vec3 position_um;
  double brightness = 1;
};

/// What the stage did while the stack was recorded, by slice; empty: nothing.
struct StageMotion {
  std::vector<Vec2> shift_um;
};

/// Counts of the camera: whole numbers 0 … 65535. The first slice's calibration says pixel size and z step.
/// @param exposure  number of the stack, so that no two have the same noise; each later one is bleached by those before
std::vector<images::Image> recorded_stack(const std::vector<GlowingBead>& beads, const StackMicroscope& microscope,
                                          const PointSpread& spread, const StageMotion& stage, std::uint64_t seed,
                                          int exposure, int threads);

}  // namespace mbtfm::drawing
