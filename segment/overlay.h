/// A picture of a segmentation on its images, to judge it by eye.
#pragma once

#include <optional>

#include "segment/png.h"
#include "segment/segment_cell.h"

namespace mbtfm::segment {

/// Actin in grey, adhesions in purple, both stretched to their own contrast; over them the outline, the adhesions'
/// ellipses, the fibres in the colours of their types (Okabe & Ito's palette, which colour-blind people can tell
/// apart) and all ids; below a legend and a scale bar.
Picture draw_overlay(const std::optional<Channel>& adhesion, const std::optional<Channel>& actin,
                     const Segmentation& segmentation);

}  // namespace mbtfm::segment
