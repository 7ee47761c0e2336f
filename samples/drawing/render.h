/// A microscope: fluorescent specimens, what the optics make of them, and what the camera records.
#pragma once

#include <cstdint>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"
#include "samples/drawing/raster.h"
#include "samples/drawing/scenario.h"

namespace mbtfm::drawing {

/// The microscope at its `image_quality`: good has three times the light, half the haze and unevenness of ordinary;
/// poor has a third of the light, twice the haze and a PSF wider by a third.
MicroscopeParameters at_quality(MicroscopeParameters microscope);

/// Paxillin and actin: relative density of fluorophore, about 1 in a bright adhesion or fibre.
images::Image paxillin_specimen(const Cell& cell, const MicroscopeParameters& microscope, std::uint64_t seed,
                                int threads);
images::Image actin_specimen(const Cell& cell, const ActinParameters& actin, const MicroscopeParameters& microscope,
                             std::uint64_t seed, int threads);

/// The nucleus as it is seen in actin: a darker ellipse near the middle of the cell.
struct Nucleus {
  Vec2 centre_um, long_axis;  ///< long_axis: unit vector
  double half_length_um = 0, half_width_um = 0;
  /// From the centre, 1 on its rim.
  double distance(Vec2 point) const;
};
Nucleus nucleus_of(const Cell& cell, std::uint64_t seed);

/// Photons by pixel of a specimen: PSF, haze, uneven illumination.
images::Image photons_of(const images::Image& specimen, const MicroscopeParameters& microscope, int threads);
/// Photons by pixel of beads: the spots are images already (bead and PSF); haze and illumination are added.
images::Image photons_of(const std::vector<Spot>& beads, const MicroscopeParameters& microscope, int threads);

/// Counts of the camera: photon (Poisson) and read noise, gain, offset; whole numbers 0 … 65535.
/// @param exposure  number of the image, so that no two have the same noise
images::Image recorded(const images::Image& photons, const MicroscopeParameters& microscope, std::uint64_t seed,
                       int exposure, int threads);

/// Where each bead is in each image, and how bright.
struct BeadImages {
  std::vector<Spot> relaxed, stressed;
};
/// @param stressed_um  positions in the stressed state, drift and noise included, by bead
/// A share of the beads is missing in one of the images, at random.
BeadImages bead_spots(const std::vector<Vec2>& relaxed_um, const std::vector<Vec2>& stressed_um,
                      double lost_bead_fraction, const MicroscopeParameters& microscope, std::uint64_t seed);

}  // namespace mbtfm::drawing
