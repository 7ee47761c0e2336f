/// A picture of a segmentation on its images, to judge it by eye.
#pragma once

#include <optional>

#include "segment/png.h"
#include "segment/segment_cell.h"

namespace mbtfm::segment {

/// The part of the images that holds the cell: actin in grey, adhesions in purple, both stretched to their own
/// contrast; over them the outline, the adhesions' ellipses and the fibres in the colours that their types have in the
/// report (Okabe & Ito's palette, which colour-blind people can tell apart), all fibre ids, and the adhesion ids that
/// have room, the largest adhesions' first; below a legend and a scale bar.
Picture draw_overlay(const std::optional<Channel>& adhesion, const std::optional<Channel>& actin,
                     const Segmentation& segmentation);

}  // namespace mbtfm::segment
