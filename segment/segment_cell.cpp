#include "segment/segment_cell.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/csv.h"
#include "pipeline/contract/errors.h"
#include "segment/emptiness.h"

namespace mbtfm::segment {

void declare(ParameterList& list, SegmentParameters& p) {
  list.table("");
  list.add("pixel_size_um", p.pixel_size_um, Range::positive(),
           "side of a pixel in the specimen (um); unset: from the image's own calibration");
  list.table("segment");
  list.add(
      "cell", p.cell, {.low = 0},
      "which cell of the image, by area from 1, the largest; 0: all, each in a folder cell_1, cell_2, … of its own");
  declare(list, p.adhesion_plane, "adhesion", "the adhesion image");
  declare(list, p.actin_plane, "actin", "the actin image");
  list.add("contact_sheet", p.contact_sheet,
           "draw contact_sheet.png, overlays over the values of one or two of these parameters: name=a,b,c name=d,e");
  declare(list, p.adhesions);
  declare(list, p.fibres);
  declare(list, p.outline);
}

namespace {

void require_content(const Channel& channel) {
  const std::string reason = emptiness_of(channel.image);
  if (!reason.empty())
    throw InputError(channel.name, "a picture of a cell", reason,
                     "is this the right file, channel and page? Was it overexposed?");
}

std::vector<Adhesion> adhesions_of(const Channel& channel, double pixel_um, const SegmentParameters& p) {
  require_content(channel);
  const auto found = find_adhesions(channel.image, pixel_um, p.adhesions);
  if (found.empty())
    throw InputError(
        channel.name,
        "bright spots of " + shortest(p.adhesions.adhesion_smallest_um2) + " um² or more that stand out of the noise",
        "no adhesion: " + why_no_adhesions(channel.image, pixel_um, p.adhesions),
        "is this the adhesion channel, in focus? Check pixel_size_um (" + in_um(pixel_um) +
            "), adhesion_channel, and adhesion_seed_noise for a faint image");
  return found;
}

std::vector<CellOutline> outlines_of(const Channel& channel, const std::vector<Adhesion>& adhesions, double pixel_um,
                                     const SegmentParameters& p) {
  require_content(channel);
  std::vector<CellOutline> cells = find_cells(channel.image, adhesions, pixel_um, p.outline);
  if (cells.empty())
    throw InputError(
        channel.name, "a cell brighter than its surroundings",
        "no cell: nothing of " + shortest(p.outline.outline_smallest_um2) + " um² or more stands out of the noise",
        "is this the right channel and page? Check pixel_size_um (" + in_um(pixel_um) + ") and outline_smallest_um2");
  if (cells.front().is_sheet)
    throw InputError(
        channel.name, "single cells", "cells that touch over " + brief(cells.front().area_um2) + " um²",
        "crop the image to a single cell; outline_largest_um2 is " + shortest(p.outline.outline_largest_um2));
  return cells;
}

/// The cells that the parameters ask for.
std::vector<CellOutline> chosen(std::vector<CellOutline> cells, const Channel& channel, const SegmentParameters& p) {
  if (p.cell == 0) return cells;
  if (p.cell > static_cast<int>(cells.size()))
    throw InputError(channel.name, "cell " + std::to_string(p.cell), std::to_string(cells.size()) + " in all",
                     "cells that touch count as one");
  return {std::move(cells[static_cast<std::size_t>(p.cell - 1)])};
}

struct Crop {
  Image image;
  Vec2 origin_um;
};

/// The part of the image that shows the cell, and as much around it as backgrounds are taken over.
Crop crop_to(const Image& image, const Polygon& outline_um, double pixel_um) {
  constexpr double kMargin_um = 10;
  Vec2 low = outline_um.front(), high = low;
  for (const Vec2 p : outline_um) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  const auto place = [&](double at_um, int n) { return std::clamp(static_cast<int>(at_um / pixel_um), 0, n); };
  const int left = place(low.x - kMargin_um, image.width), top = place(low.y - kMargin_um, image.height);
  Crop crop{image, {left * pixel_um, top * pixel_um}};
  crop.image.width = place(high.x + kMargin_um, image.width) - left;
  crop.image.height = place(high.y + kMargin_um, image.height) - top;
  crop.image.pixels.clear();
  for (int row = top; row < top + crop.image.height; ++row) {
    const auto first = image.pixels.begin() + static_cast<std::ptrdiff_t>(row) * image.width + left;
    crop.image.pixels.insert(crop.image.pixels.end(), first, first + crop.image.width);
  }
  return crop;
}

std::vector<Fibre> fibres_of(const Channel& actin, const Cell& cell, double pixel_um, const FibreParameters& p) {
  require_content(actin);
  const Crop crop = crop_to(actin.image, cell.outline_um, pixel_um);
  Polygon outline = cell.outline_um;
  std::vector<Adhesion> adhesions = cell.adhesions;
  for (Vec2& point : outline) point = point - crop.origin_um;
  for (Adhesion& a : adhesions) a.position_um = a.position_um - crop.origin_um;
  std::vector<Fibre> fibres = find_fibres(crop.image, outline, adhesions, pixel_um, p);
  for (Fibre& f : fibres)
    for (Vec2& point : f.points_um) point += crop.origin_um;
  return fibres;
}

}  // namespace

std::vector<Segmentation> segment_cells(const std::optional<Channel>& adhesion, const std::optional<Channel>& actin,
                                        const SegmentParameters& p, const HandDrawn& drawn) {
  if (!adhesion && !actin) throw UsageError("an adhesion image or an actin image is needed, best both");
  if (drawn.fibres && p.cell == 0)
    throw UsageError("fibres drawn by hand belong to one cell: choose it (cell), not all of them (cell = 0)");
  const Channel &first = adhesion ? *adhesion : *actin, &second = actin ? *actin : *adhesion;
  require_equal_sizes(first, second);
  const double pixel_um = common_pixel_size_um(first, second, p.pixel_size_um);
  const Field field{first.image.width, first.image.height, pixel_um};
  const auto found = drawn.adhesions ? hand_drawn_adhesions(*drawn.adhesions, adhesion, field)
                     : adhesion      ? adhesions_of(*adhesion, pixel_um, p)
                                     : std::vector<Adhesion>{};
  const Channel& shape = actin ? *actin : *adhesion;
  const auto outlines =
      drawn.outline ? std::vector{hand_drawn_outline(*drawn.outline, field)} : outlines_of(shape, found, pixel_um, p);
  std::vector<Segmentation> result;
  for (const CellOutline& outline : chosen(outlines, shape, p)) {
    Segmentation s{.cell = {{}, {}, outline.outer_um, outline.holes_um},
                   .pixel_size_um = pixel_um,
                   .n_cells = static_cast<int>(outlines.size()),
                   .area_um2 = outline.area_um2,
                   .is_cut_by_border = outline.is_cut_by_border};
    s.cell.adhesions = inside(outline, found);
    s.n_adhesions_outside = static_cast<int>(found.size() - s.cell.adhesions.size());
    if (!found.empty() && s.cell.adhesions.empty() && p.cell != 0)
      throw InputError(drawn.adhesions ? drawn.adhesions->name : adhesion->name, "adhesions inside the cell's outline",
                       std::to_string(found.size()) + " outside and none inside",
                       "do both channels show the same cell at the same place?");
    if (drawn.fibres)
      s.cell.fibres = hand_drawn_fibres(*drawn.fibres, s.cell.adhesions, s.cell.outline_um, actin, field, p.fibres);
    else if (actin)
      s.cell.fibres = fibres_of(*actin, s.cell, pixel_um, p.fibres);
    result.push_back(std::move(s));
  }
  return result;
}

Segmentation segment_cell(const std::optional<Channel>& adhesion, const std::optional<Channel>& actin,
                          const SegmentParameters& p, const HandDrawn& drawn) {
  return segment_cells(adhesion, actin, p, drawn).front();
}

}  // namespace mbtfm::segment
