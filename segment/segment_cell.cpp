#include "segment/segment_cell.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/csv.h"
#include "pipeline/contract/errors.h"
#include "segment/emptiness.h"

namespace mbtfm::segment {

void declare(ParameterList& list, SegmentParameters& p) {
  list.table("");
  list.add("pixel_size_um", p.pixel_size_um, Range::pixel_um(),
           "side of a pixel in the specimen (um); unset: from the image's own calibration");
  list.table("segment");
  list.add("binning", p.binning, Range::between(1, kLargestBinning),
           "the images are reduced first: means of blocks of so many pixels a side");
  list.add(
      "cell", p.cell, {.low = 0},
      "which cell of the image, by area from 1, the largest; 0: all, each in a folder cell_1, cell_2, … of its own");
  declare(list, p.adhesion_plane, "adhesion", "the adhesion image");
  declare(list, p.actin_plane, "actin", "the actin image");
  list.add("align_channels", p.align_channels,
           "move fibres and outline to where the adhesion image has them; auto: where fibre ends tell a shift",
           {"auto", "off"});
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

/// Move what the actin image shows to where the adhesion image has it.
void align(Segmentation& s, CellOutline& outline, std::vector<TracedFibre>& traced, const std::vector<Adhesion>& adhesions,
           const SegmentParameters& p) {
  std::vector<Fibre> fibres;
  for (const TracedFibre& t : traced) fibres.push_back(t.fibre);
  s.alignment = align_channels(fibres, adhesions);
  if (!s.alignment || p.align_channels == "off" || !s.alignment->is_significant()) return;
  s.is_aligned = true;
  const auto move = [&](auto& points) {
    for (Vec2& point : points) point = s.alignment->of(point);
  };
  move(outline.outer_um);
  for (Polygon& hole : outline.holes_um) move(hole);
  s.cell.outline_um = outline.outer_um;
  s.cell.holes_um = outline.holes_um;
  for (TracedFibre& t : traced) {
    for (Polyline* points : {&t.fibre.points_um, &t.before.points_um, &t.after.points_um}) move(*points);
  }
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
  if (actin && drawn.outline && !drawn.fibres) require_content(*actin);  // else the outline has asked for it
  std::vector<Segmentation> result;
  for (const CellOutline& outline : chosen(outlines, shape, p)) {
    Segmentation s{.cell = {{}, {}, outline.outer_um, outline.holes_um, outline.is_cut},
                   .pixel_size_um = pixel_um,
                   .n_cells = static_cast<int>(outlines.size()),
                   .area_um2 = outline.area_um2,
                   .is_cut_by_border = outline.is_cut_by_border()};
    if (!s.is_cut_by_border) s.cell.is_cut.clear();
    std::vector<TracedFibre> traced;
    if (actin && !drawn.fibres) traced = trace_fibres(actin->image, s.cell.outline_um, pixel_um, p.fibres);
    CellOutline around = outline;
    if (adhesion && !drawn.outline) align(s, around, traced, found, p);
    s.cell.adhesions = inside(around, found);
    s.n_adhesions_outside = static_cast<int>(found.size() - s.cell.adhesions.size());
    if (!found.empty() && s.cell.adhesions.empty() && p.cell != 0)
      throw InputError(drawn.adhesions ? drawn.adhesions->name : adhesion->name, "adhesions inside the cell's outline",
                       std::to_string(found.size()) + " outside and none inside",
                       "do both channels show the same cell at the same place?");
    if (drawn.fibres)
      s.cell.fibres = hand_drawn_fibres(*drawn.fibres, s.cell.adhesions, s.cell.outline_um, actin, field, p.fibres,
                                        cuts_of(s.cell));
    else if (actin)
      s.cell.fibres = tied(std::move(traced), s.cell.adhesions, s.cell.outline_um, p.fibres, cuts_of(s.cell));
    result.push_back(std::move(s));
  }
  return result;
}

Segmentation segment_cell(const std::optional<Channel>& adhesion, const std::optional<Channel>& actin,
                          const SegmentParameters& p, const HandDrawn& drawn) {
  return segment_cells(adhesion, actin, p, drawn).front();
}

}  // namespace mbtfm::segment
