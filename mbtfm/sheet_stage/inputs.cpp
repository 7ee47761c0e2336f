#include "mbtfm/sheet_stage/runs.h"

#include <algorithm>

#include "pipeline/contract/errors.h"
#include "segment/cells/mask.h"

namespace mbtfm::sheet_stage {

Region region_of(const outlines::Rings& rings) {
  Region region;
  for (const Polygon& ring : rings.points_um) region.rims.emplace_back(ring);
  region.cuts = rings.cuts;
  return region;
}

std::vector<Polygon> adhesive_area(const Parameters& p, stage::StageContext& context, const Region& sheet) {
  if (!context.has_input("adhesive")) return {};
  const Path file = context.input("adhesive");
  const std::vector<Polygon> rings = outlines::read_rings(file, p.pixel_size_um).points_um;
  const Polygon& outline = sheet.rims.front().points_um();
  const auto any_in = [](const Polygon& points, const Polygon& area) {
    return std::ranges::any_of(points, [&](Vec2 point) { return contains(area, point); });
  };
  if (!any_in(rings.front(), outline) && !any_in(outline, rings.front()))
    throw InputError(file.string(), "an area beneath the sheet, where it adheres", "one beside it",
                     "are outline and adhesive area of one image and in one unit?");
  return rings;
}

Region with_borders_of(Region region, const std::vector<Polygon>& adhesive_um) {
  constexpr double kClear_um = 0.1;  // nearer to the rim a border would ask for slivers
  const Polygon& rim = region.rims.front().points_um();
  for (const Polygon& border : adhesive_um)
    if (std::ranges::all_of(border,
                            [&](Vec2 p) { return contains(rim, p) && distance_to_boundary_um(rim, p) > kClear_um; }))
      region.lines.emplace_back(border);
  return region;
}

CellLabels read_labels(const Path& file, const std::optional<double>& pixel_um) {
  if (!pixel_um) throw UsageError("pixel_size_um is missing: " + file.string() + " counts in pixels");
  const cells::LabelMask mask = cells::with_parts_labelled(cells::read_mask(file));
  return with_lines_filled({mask.width, mask.height, *pixel_um, mask.labels}, cells::kWidestLine_px);
}

}  // namespace mbtfm::sheet_stage
