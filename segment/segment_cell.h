/// From the images of one cell to its segmentation.
#pragma once

#include <optional>
#include <string>

#include "pipeline/contract/types.h"
#include "segment/adhesions.h"
#include "segment/fibres.h"
#include "segment/image.h"
#include "segment/outline.h"

namespace mbtfm::segment {

struct SegmentParameters {
  std::optional<double> pixel_size_um;  ///< no default: it scales every force; the image's own calibration if unset
  int adhesion_page = 1;                ///< most cameras write one page a file
  int actin_page = 1;
  AdhesionParameters adhesions;
  FibreParameters fibres;
  OutlineParameters outline;
};

void declare(ParameterList& list, SegmentParameters& parameters);

/// An image and the name by which errors call it.
struct Channel {
  std::string name;
  Image image;
};

struct Segmentation {
  Cell cell;
  double pixel_size_um = 0;
  int n_adhesions_outside = 0;  ///< found beyond the cell and left out
};

/// The pixel size of the channels given: the parameter, or else the calibration that they have.
/// @throws InputError where neither tells it, the channels contradict each other, or their sizes differ
double common_pixel_size_um(const std::optional<Channel>& adhesion, const std::optional<Channel>& actin,
                            const SegmentParameters& parameters);

/// Adhesions from the adhesion channel, fibres from actin, the outline from actin or, without it, from adhesions.
/// Without an adhesion channel there are no adhesions and every fibre is an arc; without actin no fibres.
/// @throws UsageError without any channel
/// @throws InputError for sizes and calibration as above; where no cell, or in a given adhesion channel no adhesion,
///         is found
Segmentation segment_cell(const std::optional<Channel>& adhesion, const std::optional<Channel>& actin,
                          const SegmentParameters& parameters);

}  // namespace mbtfm::segment
