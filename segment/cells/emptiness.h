/// Images that show nothing, and why.
#pragma once

#include <optional>
#include <string>

#include "segment/images/image.h"

namespace mbtfm::cells {

/// Why nothing in the image can be measured: "every pixel is 100", "42 % of the pixels at 255, the brightest value: the
/// detector was saturated". Empty where there may be something.
///
/// More than a tenth at one brightest value is no structure: adhesions cover a few per cent of a field, and an image
/// that is not cut off has few pixels at its very maximum.
std::string emptiness_of(const images::Image& image);

/// The negative of an image that looks like one: its darkest pixels differ more from the middle one than its brightest.
/// Beads, adhesions, fibres and a cell of less than half of the field are bright on dark.
std::optional<images::Image> negative_of_dark_on_bright(images::Image image);

}  // namespace mbtfm::cells
