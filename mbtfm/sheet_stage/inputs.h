/// The files that all runs of mbtfm-sheet read, and what they mean to a sheet.
#pragma once

#include "continuum/outlines/rings.h"
#include "continuum/sheet/borders.h"
#include "mbtfm/sheet_stage/parameters.h"
#include "pipeline/stage/stage.h"

namespace mbtfm::sheet_stage {

Region region_of(const outlines::Rings& rings);

/// Where the sheet adheres: none where that is everywhere.
/// @throws InputError where that is nowhere
std::vector<Polygon> adhesive_area(const Parameters& p, stage::StageContext& context, const Region& sheet);

/// The triangles end at the border of the adhesive area where it lies inside of the sheet.
Region with_borders_of(Region region, const std::vector<Polygon>& adhesive_um);

/// The label image of the cells; lines between them are given to the nearest cell. @throws UsageError without a pixel
/// size
CellLabels read_labels(const Path& file, const std::optional<double>& pixel_um);

}  // namespace mbtfm::sheet_stage
