/// What mbtfm-segment says of the cells that it found.
#pragma once

#include <optional>
#include <vector>

#include "pipeline/stage/stage.h"
#include "segment/cells/segment_cell.h"
#include "segment/images/channels.h"

namespace mbtfm::cells {

/// Figures and the last line, of one cell and of all cells of an image.
StageReport report_of(const Segmentation& cell);
StageReport report_of(const std::vector<Segmentation>& cells);

/// "7 ventral, 3 dorsal, 2 arcs", and of the other types those that there are.
std::string types_in_words(const std::vector<Fibre>& fibres);

/// Which of its parts were drawn by hand.
void add_drawn_by_hand(StageReport& report, const HandDrawn& drawn);

/// Notice what may be wrong with the cell or its images.
/// @param has_actin  there is an image of it
void notice_doubts(const Segmentation& cell, const SegmentParameters& parameters, bool has_actin,
                   stage::StageContext& context);

/// @throws InputError where no cell looks like that
void expect_plausible(stage::StageContext& context, const Segmentation& cell);

/// A pixel size that no image states is doubted if the cell and its parts are not as large with it as cells are.
std::optional<Finding> noticed_unchecked(std::initializer_list<const std::optional<images::Channel>*> channels,
                                         double pixel_size_um, const Segmentation& cell);

}  // namespace mbtfm::cells
