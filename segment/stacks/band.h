/// Inside of the tracker of beads in stacks: what is of a bead's size, and no smaller or larger.
#pragma once

#include <vector>

#include "segment/stacks/spots.h"
#include "segment/stacks/volume.h"

namespace mbtfm::stacks {

/// A maximum of the band-passed volume, between voxels.
struct Peak {
  Vec3 place;
  double height = 0;  ///< of a spot that answers so
};

/// Maxima of the difference of two Gaussian averages, of 0.8 and 1.6 widths along each axis, where they stand out of
/// the noise, that of the light there included, by `detection_snr`: the first average keeps touching beads apart, the
/// second takes away what is wider than a bead. The volume is filtered in columns, so that little memory is taken.
std::vector<Peak> peaks_of(const Volume& volume, Widths widths, const Noise& noise, double detection_snr, int threads);

}  // namespace mbtfm::stacks
