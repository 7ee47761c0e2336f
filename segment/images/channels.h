/// Images that belong together.
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
/// @throws InputError where neither tells it, or they contradict each other
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

}  // namespace mbtfm::images
