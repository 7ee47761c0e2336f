#include "continuum/outlines/rings.h"

#include <algorithm>
#include <cmath>

#include "continuum/sheet/curve.h"
#include "pipeline/contract/errors.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/sheet_files.h"
#include "pipeline/files/tables.h"
#include "segment/cells/mask.h"
#include "segment/rois/roi.h"

namespace mbtfm::outlines {
namespace {

Cuts cuts_of(const Polygon& outline_um, const std::vector<bool>& is_cut) {
  Cell cell;
  cell.outline_um = outline_um;
  cell.is_cut = is_cut;
  return mbtfm::cuts_of(cell);
}

/// The largest part of a mask, or an ImageJ selection, in um.
Rings rings_of_picture(const Path& file, double pixel_um) {
  constexpr double kAnySize = 1e12;
  cells::OutlineParameters any;
  any.outline_smallest_um2 = 0;
  any.outline_smallest_hole_um2 = 0;
  any.outline_largest_um2 = kAnySize;
  cells::CellOutline outline;
  if (file.extension() == ".roi" || file.extension() == ".zip") {
    constexpr int kAnyField = 1 << 20;
    outline = cells::hand_drawn_outline({file.string(), rois::read_rois(file)}, {kAnyField, kAnyField, pixel_um});
  } else {
    const cells::LabelMask mask = cells::read_mask(file);
    outline = cells::mask_outlines(mask, 0, {mask.width, mask.height, pixel_um}, any).front();
  }
  Rings rings{.points_um = {outline.outer_um}, .cuts = cuts_of(outline.outer_um, outline.is_cut)};
  rings.points_um.insert(rings.points_um.end(), outline.holes_um.begin(), outline.holes_um.end());
  return rings;
}

/// Without points that repeat the one before.
Polygon distinct(const Polygon& ring) {
  Polygon points;
  for (const Vec2 p : ring)
    if (points.empty() || !(points.back() == p)) points.push_back(p);
  while (points.size() > 1 && points.front() == points.back()) points.pop_back();
  return points;
}

Rings rings_of_table(const Path& file) {
  Rings rings{.points_um = files::read_outline(file)};
  std::vector<bool> is_cut;
  for (const files::OutlinePoint& point : files::read(file, files::outline_table()))
    if (point.ring == 0) is_cut.push_back(point.is_cut);
  rings.cuts = cuts_of(rings.points_um.front(), is_cut);
  return rings;
}

}  // namespace

Rings read_rings(const Path& file, const std::optional<double>& pixel_um) {
  Rings rings;
  if (file.extension() == ".csv") {
    rings = rings_of_table(file);
  } else {
    if (!pixel_um) throw UsageError("pixel_size_um is missing: " + file.string() + " counts in pixels");
    rings = rings_of_picture(file, *pixel_um);
  }
  for (Polygon& ring : rings.points_um) ring = distinct(ring);
  const std::string crossing = sheet::crossing_of(rings.points_um);
  if (!crossing.empty())
    throw InputError(file.string(), "an outline that does not cross itself", crossing + " cross",
                     "a piece runs from a point to the next; remove the loop, or draw the outline again");
  for (const Polygon& ring : rings.points_um) {
    const double around = ring.size() < 3 ? 0 : length_um(ring) + norm(ring.front() - ring.back());
    constexpr double kThinnest = 1e-6;  // a strip four millionths as wide as long
    if (!(std::abs(signed_area_um2(ring)) > kThinnest * around * around))
      throw InputError(file.string(), "an outline around an area", "one around none");
  }
  return rings;
}

double usual_error_um(const Path& file, const std::optional<double>& pixel_um) {
  // half a pixel of those that mbtfm-segment finds (notes/sheets.md); hands follow an edge to some pixels
  constexpr double kFound_um = 0.05, kDrawn_um = 0.5;
  const bool is_selection = file.extension() == ".roi" || file.extension() == ".zip";
  const files::OutlineSource source = is_selection                 ? files::OutlineSource::drawn
                                      : file.extension() != ".csv" ? files::OutlineSource::mask
                                                                   : files::source_of_outline(file);
  switch (source) {
    case files::OutlineSource::drawn:
      return kDrawn_um;
    case files::OutlineSource::mask:
      return std::max(kFound_um, pixel_um.value_or(kFound_um));
    case files::OutlineSource::found:
      break;
  }
  return kFound_um;
}

}  // namespace mbtfm::outlines
