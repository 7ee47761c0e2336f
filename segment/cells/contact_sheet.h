/// Overlays over the values of one or two parameters in one picture, to choose these by eye.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "segment/cells/segment_cell.h"
#include "segment/images/png.h"

namespace mbtfm::cells {

/// One direction of a contact sheet: a parameter and the values it takes.
struct SheetAxis {
  std::string parameter;
  std::vector<std::string> values;
};

/// "adhesion_seed_noise=3,4,5 fibre_least_probability=0.5,0.9": the columns, then the rows.
/// @throws UsageError where it is not written so, or has no or more than two axes, or more than 64 pictures
std::vector<SheetAxis> parse_axes(const std::string& text);

/// A segmentation for each pair of values of `parameters.contact_sheet`, drawn in columns and rows; a caption says
/// what was found, or why nothing was.
/// @param drawn  is used in all of them
/// @throws UsageError where an axis names no parameter of the segmentation or a value is out of its range
images::Picture draw_contact_sheet(const std::optional<images::Channel>& adhesion,
                                   const std::optional<images::Channel>& actin, const SegmentParameters& parameters,
                                   const HandDrawn& drawn = {});

}  // namespace mbtfm::cells
