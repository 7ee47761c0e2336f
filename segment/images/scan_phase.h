/// Rows that a confocal microscope scans to and fro: those of the way back lie aside if its timing is off.
#pragma once

#include <optional>

#include "pipeline/contract/findings.h"
#include "segment/images/channels.h"

namespace mbtfm::images {

struct ScanPhase {
  double px = 0;  ///< shift of the first, third, fifth row … to the right of the others
  double sigma_px = 0;
};

/// The shift at which rows of both kinds are most alike, by the correlation of their slopes; nothing where the picture
/// shows none for sure.
///
/// Rows that are neighbours measure it: what leans in the picture moves the pairs "even above odd" and "odd above even"
/// to opposite sides and so drops out. Noise is no witness, as it differs from row to row. Some cameras' noise does
/// not: so rows three apart, which only the optics make alike, must show the same shift. The standard error is that of
/// the blocks of pairs about their sum.
std::optional<ScanPhase> scan_phase(const Image& image);

/// Each row moved by half of the phase, the places between pixels by a Lanczos kernel (a = 4).
Image without_scan_phase(const Image& image, double phase_px);

/// Take the phase off if there is one, and say so.
std::optional<Finding> take_scan_phase_off(Channel& channel);

}  // namespace mbtfm::images
