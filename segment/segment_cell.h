/// From the images of one cell to its segmentation.
#pragma once

#include <optional>
#include <string>

#include "pipeline/contract/types.h"
#include "segment/adhesions.h"
#include "segment/channels.h"
#include "segment/fibres.h"
#include "segment/hand_drawn.h"
#include "segment/outline.h"

namespace mbtfm::segment {

struct SegmentParameters {
  std::optional<double> pixel_size_um;  ///< no default: it scales every force; the image's own calibration if unset
  PlaneChoice adhesion_plane, actin_plane;
  std::string contact_sheet;  ///< none: it takes a segmentation for each of its pictures
  AdhesionParameters adhesions;
  FibreParameters fibres;
  OutlineParameters outline;
};

void declare(ParameterList& list, SegmentParameters& parameters);

struct Segmentation {
  Cell cell;
  double pixel_size_um = 0;
  int n_adhesions_outside = 0;  ///< found beyond the cell and left out
};

/// Adhesions from the adhesion channel, fibres from actin, the outline from actin or, without it, from adhesions.
/// Without an adhesion channel there are no adhesions and every fibre is an arc; without actin no fibres. What is drawn
/// by hand is used instead of each.
/// @throws UsageError without any channel
/// @throws InputError where sizes or calibrations contradict each other or none tells the pixel size; where no cell, or
/// in a given adhesion channel no adhesion,
///         is found
Segmentation segment_cell(const std::optional<Channel>& adhesion, const std::optional<Channel>& actin,
                          const SegmentParameters& parameters, const HandDrawn& drawn = {});

}  // namespace mbtfm::segment
