/// A segmented cell as ImageJ selections, to look at, correct and give back by hand.
#pragma once

#include <vector>

#include "pipeline/contract/cell.h"
#include "segment/rois/roi.h"

namespace mbtfm::cells {

/// The outline as a polygon `outline`, its holes as `hole 1`, adhesions as ellipses `adhesion 12`, `anchor 13` or
/// `candidate 14`, fibres as segmented lines `ventral 3`, each in its colour of the overlay. No groups: ImageJ would
/// paint over the colours with its own of the group.
std::vector<rois::Roi> rois_of(const Cell& cell, double pixel_size_um);

}  // namespace mbtfm::cells
