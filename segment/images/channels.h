/// Images that belong together, and the rows of one that a scanner put aside.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/findings.h"
#include "pipeline/stage/plausible.h"
#include "segment/images/image.h"

namespace mbtfm::images {

/// An image and the name by which errors call it.
struct Channel {
  std::string name;
  Image image;
};

/// "0.1 um", for messages.
std::string in_um(double length_um);

/// @throws InputError where the two are not of one size
void require_equal_sizes(const Channel& first, const Channel& second);

/// Size and calibration of an image, and the name by which errors call it.
struct NamedField {
  std::string name;
  ImageField field;
};
/// The images of the beads and those of the cell must show one field from one corner on: all places are counted from
/// there. Pixels may differ, as of images that were binned, if they are stated.
/// @throws InputError where they do not
void require_same_field(const NamedField& cell, const NamedField& beads);

/// The pixel size of two images of one field: the one given, or else the calibration that they have.
/// @throws InputError if neither states it, or they contradict each other
double common_pixel_size_um(const Channel& first, const Channel& second, std::optional<double> given_um);

/// A finding where the image is a JPEG.
std::optional<Finding> noticed_loss(const Channel& channel);
/// Share of the pixels that have the image's largest value: one or two of a picture that is not saturated.
double share_at_brightest(const Image& image);
/// A finding where the detector was saturated.
std::optional<Finding> noticed_saturation(const Channel& channel);

/// Both, and a note of which plane was taken without being chosen.
std::vector<std::optional<Finding>> noticed_in(const Channel& channel);

/// A note where none of these images states its pixel size: nothing contradicts the one that was given.
std::optional<Finding> noticed_unchecked(const std::vector<const Channel*>& channels, double pixel_size_um);

/// Where the pixel size given is not that of the image's own calibration. Both are of the image as it is, binned or
/// not.
std::optional<stage::Doubt> doubt_about_calibration(const Channel& channel, std::optional<double> given_um);

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
