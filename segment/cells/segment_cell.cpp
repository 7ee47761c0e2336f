#include "segment/cells/segment_cell.h"

#include <algorithm>
#include <functional>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/stage/parameters.h"
#include "segment/cells/adhesions.h"
#include "segment/cells/channel_alignment.h"
#include "segment/cells/fibre_ends.h"

namespace mbtfm::cells {

void declare(stage::ParameterList& list, SegmentParameters& p) {
  list.table("");
  list.add("pixel_size_um", p.pixel_size_um, Range::pixel_um());
  list.table("segment");
  list.add("binning", p.binning, Range::between(1, images::kLargestBinning));
  list.add("cell", p.cell, {.low = 0});
  declare(list, p.adhesion_plane, "adhesion");
  declare(list, p.actin_plane, "actin");
  list.add("align_channels", p.align_channels, {}, {Switch::automatic, Switch::off});
  list.add("contact_sheet", p.contact_sheet);
  declare(list, p.adhesions);
  declare(list, p.candidates);
  declare(list, p.fibres);
  declare(list, p.outline);
}

namespace {

/// Nothing bright, or something that is too small for a cell.
[[noreturn]] void no_cell(const images::Channel& channel, const std::vector<Adhesion>& adhesions, double pixel_um,
                          const OutlineParameters& p) {
  const std::string expected = "a cell brighter than its surroundings",
                    size = "pixel_size_um (" + images::in_um(pixel_um) + ")";
  const double least_um2 = p.outline_smallest_um2;
  constexpr double kSpeck = 0.02;  // 1 um² by default: less is noise
  OutlineParameters for_specks = p;
  for_specks.outline_smallest_um2 *= kSpeck;
  const CellsInImage small = find_cells(channel.image, adhesions, pixel_um, for_specks);
  if (small.cells.empty()) {
    const auto negative = negative_of_dark_on_bright(channel.image);
    if (negative && !find_cells(*negative, adhesions, pixel_um, p).cells.empty())
      throw InputError(channel.name, expected, "one that is darker than its surroundings", kInvert);
    throw InputError(channel.name, expected,
                     "no cell: nothing of " + shortest(least_um2) + " um² or more stands out of the noise",
                     "is this the right channel and page? Check " + size + " and outline_smallest_um2");
  }
  throw InputError(channel.name, expected,
                   "only smaller things: the largest covers " + brief(small.cells.front().area_um2) +
                       " um², and a cell at least " + shortest(least_um2) + " um² (outline_smallest_um2)",
                   "is it the cell? Then set outline_smallest_um2 in [segment] below its area. Else check " + size +
                       ": a number that is too small makes cells small");
}

CellsInImage outlines_of(const images::Channel& channel, const std::vector<Adhesion>& adhesions, double pixel_um,
                         const SegmentParameters& p) {
  require_content(channel);
  CellsInImage found = find_cells(channel.image, adhesions, pixel_um, p.outline);
  const std::vector<CellOutline>& cells = found.cells;
  if (cells.empty()) no_cell(channel, adhesions, pixel_um, p.outline);
  if (cells.front().is_sheet)
    throw InputError(channel.name, "single cells", "cells that touch over " + brief(cells.front().area_um2) + " um²",
                     "crop the image to a single cell; outline_largest_um2 is " +
                         shortest(p.outline.outline_largest_um2) +
                         ". If the image shows one cell, pixel_size_um is too large");
  return found;
}

/// The cells that the parameters ask for.
std::vector<CellOutline> chosen(std::vector<CellOutline> cells, const images::Channel& channel,
                                const SegmentParameters& p) {
  if (p.cell == 0) return cells;
  if (p.cell > static_cast<int>(cells.size()))
    throw InputError(channel.name, "cell " + std::to_string(p.cell), std::to_string(cells.size()) + " in all",
                     "cells that touch count as one if there is no neck between them");
  return {std::move(cells[p.cell - 1])};
}

/// Move what the actin image shows to where the adhesion image has it.
void align(Segmentation& s, CellOutline& outline, std::vector<TracedFibre>& traced,
           const std::vector<Adhesion>& adhesions, const SegmentParameters& p) {
  std::vector<Fibre> fibres;
  for (const TracedFibre& t : traced) fibres.push_back(t.fibre);
  s.alignment = align_channels(fibres, adhesions);
  if (!s.alignment || p.align_channels == Switch::off || !s.alignment->is_significant()) return;
  s.is_aligned = true;
  const auto move = [&](auto& points) {
    for (Vec2& point : points) point = s.alignment->of(point);
  };
  move(outline.outer_um);
  for (Polygon& hole : outline.holes_um) move(hole);
  s.cell.outline_um = outline.outer_um;
  s.cell.holes_um = outline.holes_um;
  for (auto* lines : {&s.unexplained_um, &s.doubtful_um})
    for (Polyline& line : *lines) move(line);
  for (TracedFibre& t : traced)
    for (Polyline* points : {&t.fibre.points_um, &t.before.points_um, &t.after.points_um}) move(*points);
}

/// The images of a field, and where its adhesions come from.
struct Inputs {
  const std::optional<images::Channel>&adhesion, &actin;
  const SegmentParameters& parameters;
  const HandDrawn& drawn;
  Field field;
  AdhesionSource source = AdhesionSource::image;
};

/// Seen ones: by hand, of a mask, or of the image.
std::vector<Adhesion> seen_adhesions(const Inputs& in) {
  if (in.source != AdhesionSource::image) return {};
  if (in.drawn.adhesions) return hand_drawn_adhesions(*in.drawn.adhesions, in.adhesion, in.field);
  if (in.drawn.adhesion_mask) return mask_adhesions(*in.drawn.adhesion_mask, in.adhesion, in.field);
  return require_adhesions(*in.adhesion, in.field.pixel_um, in.parameters.adhesions);
}

const std::string& name_of_adhesions(const Inputs& in) {
  if (in.drawn.adhesions) return in.drawn.adhesions->name;
  return in.drawn.adhesion_mask ? in.drawn.adhesion_mask->name : in.adhesion->name;
}

struct Outlines {
  std::vector<CellOutline> chosen;
  int n_cells = 1;         ///< in the image
  CellsInImage seen = {};  ///< by the actin image, whatever outline is given, or without it by that of adhesions
};

Outlines outlines_in(const Inputs& in, const std::vector<Adhesion>& found) {
  const SegmentParameters& p = in.parameters;
  if (in.drawn.outline || in.drawn.outline_mask) {
    CellsInImage seen;
    if (in.actin) seen = find_cells(in.actin->image, found, in.field.pixel_um, p.outline);
    if (in.drawn.outline)
      return {chosen({hand_drawn_outline(*in.drawn.outline, in.field)}, in.actin ? *in.actin : *in.adhesion, p), 1,
              std::move(seen)};
    return {mask_outlines(*in.drawn.outline_mask, p.cell, in.field, p.outline),
            n_cells_in(*in.drawn.outline_mask, in.field, p.outline), std::move(seen)};
  }
  const images::Channel& shape = in.actin ? *in.actin : *in.adhesion;
  CellsInImage all = outlines_of(shape, found, in.field.pixel_um, p);
  const int n_cells = static_cast<int>(all.cells.size());
  if (!in.actin) all.debris_um.clear();  // dots there are adhesions, which are named as such
  return {chosen(all.cells, shape, p), n_cells, std::move(all)};
}

/// Fibres before they are tied: traced, or drawn by hand.
struct Lines {
  std::vector<TracedFibre> traced;
  std::vector<DrawnLine> drawn;
  bool are_drawn = false;
};

/// The ends of a traced fibre that adhesions may hold. On a pattern any.
EndsToTie ends_to_hold(const Inputs& in, const CellOutline& cell, const TracedFibre& traced) {
  if (in.source == AdhesionSource::pattern) return {};
  return ends_held_by_shape(traced.fibre.points_um, cell.outer_um, in.parameters.candidates.candidate_band_um,
                            in.parameters.fibres.fibre_lamellipodium_um);
}

/// Of the fibres' ends those where an adhesion may be.
std::vector<Vec2> possible_ends_um(const Inputs& in, const CellOutline& cell, const Lines& lines) {
  std::vector<Vec2> ends;
  for (const DrawnLine& line : lines.drawn)
    for (const Vec2 end : held_ends_um(line)) ends.push_back(end);
  for (const TracedFibre& t : lines.traced) {
    const EndsToTie held = ends_to_hold(in, cell, t);
    if (held.start) ends.push_back(t.fibre.points_um.front());
    if (held.end) ends.push_back(t.fibre.points_um.back());
  }
  if (in.source == AdhesionSource::pattern)
    std::erase_if(ends, [&](Vec2 end) { return !covers(*in.drawn.adhesion_mask, end, in.field); });
  return ends;
}

/// Where adhesions may be, in this cell. A fibre that ends on a pattern is held where it ends, not at the next point of
/// a lattice, which may be a micrometre further in or out.
std::vector<Adhesion> candidates_in(const Inputs& in, const CellOutline& cell, const Lines& lines,
                                    Placement placement) {
  const CandidateParameters& p = in.parameters.candidates;
  std::vector<Adhesion> candidates = candidates_at(possible_ends_um(in, cell, lines), p.candidate_spacing_um);
  if (in.source != AdhesionSource::fibre_ends) {
    const Cell whole{.adhesions = {}, .fibres = {}, .outline_um = cell.outer_um, .holes_um = cell.holes_um};
    const std::vector<Adhesion> at_ends = candidates;
    const auto is_possible = [&](Vec2 point) {
      const bool is_taken = std::ranges::any_of(
          at_ends, [&](const Adhesion& end) { return norm(end.position_um - point) < p.candidate_spacing_um; });
      if (is_taken) return false;
      if (in.source == AdhesionSource::pattern) return covers(*in.drawn.adhesion_mask, point, in.field);
      return distance_to_edge_um(whole, point) <= p.candidate_band_um;
    };
    const auto [low, high] = extent_of(cell.outer_um);
    const auto in_cell = [&](Vec2 point) { return is_in_cell(cell, point) && is_possible(point); };
    for (Adhesion& a : lattice_candidates(low, high, p.candidate_spacing_um, placement, in_cell))
      candidates.push_back(std::move(a));
  }
  return inside(cell, candidates);  // which renews the ids
}

void require_candidates(const Inputs& in, const Cell& cell) {
  if (!cell.adhesions.empty()) return;
  if (in.source == AdhesionSource::pattern)
    throw InputError(in.drawn.adhesion_mask->name, "a pattern beneath the cell", "none of it inside the outline",
                     "does the mask lie on these images? Check candidate_spacing_um (" +
                         images::in_um(in.parameters.candidates.candidate_spacing_um) + ")");
  throw InputError(in.actin ? in.actin->name : in.adhesion->name, "places for adhesions in the cell",
                   in.source == AdhesionSource::fibre_ends ? "no fibre, at whose ends they could be" : "none",
                   "give an adhesion image or an adhesion mask, or set adhesions = cell");
}

/// As tied() for each, but a fibre has the same id wherever the candidates are: that of its place among the traced
/// ones, the longest first.
std::vector<Fibre> tied_one_by_one(std::vector<TracedFibre> traced, const Cell& cell, const CellOutline& outline,
                                   const Inputs& in) {
  const FibreParameters& p = in.parameters.fibres;
  std::ranges::stable_sort(traced, std::greater(), [](const TracedFibre& t) { return length_um(t.fibre.points_um); });
  std::vector<Fibre> fibres;
  for (std::size_t i = 0; i < traced.size(); ++i) {
    const EndsToTie held = ends_to_hold(in, outline, traced[i]);
    Fibre& fibre = traced[i].fibre;
    lead_on(traced[i], cell.adhesions, cell.outline_um, p.fibre_reach_um);
    tie_ends(fibre, cell.adhesions, cell.outline_um, p.fibre_reach_um, held);
    lead_to_cut(fibre, cuts_of(cell), p.fibre_reach_um);
    if (length_um(fibre.points_um) < p.fibre_shortest_um) continue;
    if (in.source == AdhesionSource::none) {
      fibre.type_confidence = 0;
      fibre.type_reason = "no adhesions were looked for";
    } else if (in.source != AdhesionSource::pattern) {
      fibre.type_confidence = std::min(fibre.type_confidence, 0.5);
      fibre.type_reason += held.start && held.end   ? "; candidates were put at its ends"
                           : held.start || held.end ? "; an end inside the cell, pointing away from the edge, is free"
                                                    : "; along the edge and bulging towards it: held nowhere";
    }
    fibre.fibre_id = static_cast<int>(i) + 1;
    fibres.push_back(std::move(fibre));
  }
  return fibres;
}

/// The cell's adhesions and its fibres, tied to them.
void hold(Cell& cell, std::vector<Adhesion> adhesions, Lines lines, const CellOutline& outline, const Inputs& in) {
  const SegmentParameters& p = in.parameters;
  cell.adhesions = std::move(adhesions);
  if (lines.are_drawn) {
    HeldFibres held = hold_fibres(std::move(lines.drawn), cell.adhesions, outline, p.fibres,
                                  p.candidates.anchor_area_um2, cuts_of(cell));
    cell.fibres = std::move(held.fibres);
    cell.adhesions.insert(cell.adhesions.end(), held.anchors.begin(), held.anchors.end());
  } else if (in.source == AdhesionSource::image) {
    cell.fibres = tied(std::move(lines.traced), cell.adhesions, cell.outline_um, p.fibres, cuts_of(cell));
    if (!cell.adhesions.empty())
      hold_far_ends(cell.fibres, cell.adhesions, cell.outline_um, cuts_of(cell),
                    {p.candidates.anchor_area_um2, p.fibres.fibre_lamellipodium_um});
  } else {
    cell.fibres = tied_one_by_one(std::move(lines.traced), cell, outline, in);
  }
  for (Fibre& f : cell.fibres)
    if (f.type_confidence < 0.5) f.type = FibreType::unclassified;
  for (Adhesion& a : cell.adhesions) a.edge_distance_um = distance_to_edge_um(cell, a.position_um);
}

/// Inputs that others took the place of.
std::vector<std::string> unused_in(const Inputs& in) {
  const HandDrawn& d = in.drawn;
  std::vector<std::string> unused;
  const auto add = [&](const std::string& name, const std::string& why) {
    unused.push_back(name + " is not used: " + why + ".");
  };
  if (d.outline && d.outline_mask) add(d.outline_mask->name, "the outline of " + d.outline->name + " counts");
  const bool is_seen = in.source == AdhesionSource::image;
  const std::string as_read = "adhesions = " + std::string(name_of(in.source));
  if (is_seen && d.adhesions && d.adhesion_mask)
    add(d.adhesion_mask->name, "the adhesions of " + d.adhesions->name + " count");
  if (!is_seen && d.adhesions) add(d.adhesions->name, as_read);
  if (!is_seen && in.source != AdhesionSource::pattern && d.adhesion_mask) add(d.adhesion_mask->name, as_read);
  return unused;
}

Inputs inputs_of(const std::optional<images::Channel>& adhesion, const std::optional<images::Channel>& actin,
                 const SegmentParameters& p, const HandDrawn& drawn) {
  if (!adhesion && !actin) throw UsageError("an adhesion image or an actin image is needed, best both");
  if (drawn.fibres && p.cell == 0)
    throw UsageError("fibres drawn by hand belong to one cell: choose it (cell), not all of them (cell = 0)");
  const images::Channel &first = adhesion ? *adhesion : *actin, &second = actin ? *actin : *adhesion;
  images::require_equal_sizes(first, second);
  const double pixel_um = images::common_pixel_size_um(first, second, p.pixel_size_um);
  Inputs in{adhesion, actin, p, drawn, {first.image.width, first.image.height, pixel_um}};
  in.source =
      source_of(p.candidates, adhesion || drawn.adhesions || drawn.adhesion_mask, drawn.adhesion_mask != nullptr);
  for (const auto& mask : {drawn.outline_mask, drawn.adhesion_mask})
    if (mask) require_size(*mask, in.field);
  if (in.source == AdhesionSource::pattern) require_upright_pattern(*drawn.adhesion_mask);
  return in;
}

/// The other cells in the image. What lies mostly in this one is a part of it: it may have been drawn by hand.
std::vector<Polygon> neighbours_of(const CellOutline& cell, const std::vector<CellOutline>& seen) {
  constexpr double kApart = 0.5;
  std::vector<Polygon> others;
  if (cell.is_sheet) return others;
  for (const CellOutline& other : seen)
    if (share_beyond(other, {cell}, 0) > kApart) others.push_back(other.outer_um);
  return others;
}

Segmentation segment_one(const Inputs& in, const CellOutline& outline, const std::vector<Adhesion>& found,
                         const Outlines& all) {
  const SegmentParameters& p = in.parameters;
  Segmentation s{.cell = {{}, {}, outline.outer_um, outline.holes_um, outline.is_cut},
                 .pixel_size_um = in.field.pixel_um,
                 .n_cells = all.n_cells,
                 .area_um2 = outline.area_um2,
                 .neck = outline.neck,
                 .is_cut_by_border = outline.is_cut_by_border(),
                 .source = in.source};
  if (!s.is_cut_by_border) s.cell.is_cut.clear();
  s.cell.neighbours_um = neighbours_of(outline, all.seen.cells);
  const bool is_given = in.drawn.outline || in.drawn.outline_mask;
  constexpr double kGenerous_um = 1;  // an outline drawn by hand is not false for that
  if (is_given && !all.seen.cells.empty()) s.outline_off_actin = share_beyond(outline, all.seen.cells, kGenerous_um);
  s.adhesions_beyond = share_beyond_cells(all.seen, found);
  Lines lines{.traced = {}, .drawn = {}, .are_drawn = in.drawn.fibres.has_value()};
  if (in.drawn.fibres)
    lines.drawn = drawn_lines(*in.drawn.fibres, in.actin, in.field, p.fibres);
  else if (in.actin) {
    TracedLines traced = trace_fibres(in.actin->image, s.cell.outline_um, in.field.pixel_um, p.fibres);
    lines.traced = std::move(traced.fibres);
    s.unexplained_um = std::move(traced.unexplained_um);
    constexpr double kPerhaps = 0.3;  // of the less probable hardly any is one
    for (TracedFibre& t : traced.rest)
      if (t.fibre.confidence >= kPerhaps) s.doubtful_um.push_back(std::move(t.fibre.points_um));
  }
  CellOutline around = outline;
  if (in.source == AdhesionSource::image) {
    if (in.adhesion && !is_given) align(s, around, lines.traced, found, p);
    std::vector<Adhesion> own = inside(around, found);
    s.n_adhesions_outside = static_cast<int>(found.size() - own.size());
    for (const Adhesion& a : found)
      if (inside(around, {a}).empty()) s.left_out_um.push_back(ellipse_corners(a, 24));
    if (!is_given) s.reach_um = reach_um(around, own);
    if (!found.empty() && own.empty() && p.cell != 0)
      throw InputError(name_of_adhesions(in), "adhesions inside the cell's outline",
                       std::to_string(found.size()) + " outside and none inside",
                       "do both channels show the same cell at the same place?");
    hold(s.cell, std::move(own), std::move(lines), around, in);
  } else if (in.source == AdhesionSource::none) {
    hold(s.cell, {}, std::move(lines), around, in);
  } else {
    if (in.source != AdhesionSource::fibre_ends) {
      s.second = s.cell;
      hold(*s.second, candidates_in(in, around, lines, Placement::second), lines, around, in);
    }
    std::vector<Adhesion> candidates = candidates_in(in, around, lines, Placement::first);
    hold(s.cell, std::move(candidates), std::move(lines), around, in);
    require_candidates(in, s.cell);
    if (in.source == AdhesionSource::pattern) s.pattern = pattern_at(*in.drawn.adhesion_mask, around, in.field);
  }
  if (in.source == AdhesionSource::image && in.adhesion)
    s.bleed_through = contrast_of_fibres(in.adhesion->image, s.cell, in.field.pixel_um);
  s.n_anchors = static_cast<int>(std::ranges::count(s.cell.adhesions, AdhesionOrigin::anchor, &Adhesion::origin));
  s.unused = unused_in(in);
  s.left_out_um.insert(s.left_out_um.end(), all.seen.debris_um.begin(), all.seen.debris_um.end());
  return s;
}

}  // namespace

std::vector<Segmentation> segment_cells(const std::optional<images::Channel>& adhesion,
                                        const std::optional<images::Channel>& actin, const SegmentParameters& p,
                                        const HandDrawn& drawn) {
  const Inputs in = inputs_of(adhesion, actin, p, drawn);
  const std::vector<Adhesion> seen = seen_adhesions(in), found = drawn.adhesions ? each_once(seen) : seen;
  const Outlines outlines = outlines_in(in, found);
  const bool is_given = drawn.outline || drawn.outline_mask;
  if (actin && is_given && !drawn.fibres) require_content(*actin);  // else the outline has asked for it
  std::vector<Segmentation> result;
  for (const CellOutline& outline : outlines.chosen) result.push_back(segment_one(in, outline, found, outlines));
  if (found.size() < seen.size()) {
    for (Segmentation& s : result)
      s.unused.push_back(name_of_adhesions(in) + " has " + std::to_string(seen.size() - found.size()) +
                         " of its adhesions twice. Each counts once.");
  }
  return result;
}

Segmentation segment_cell(const std::optional<images::Channel>& adhesion, const std::optional<images::Channel>& actin,
                          const SegmentParameters& p, const HandDrawn& drawn) {
  return segment_cells(adhesion, actin, p, drawn).front();
}

}  // namespace mbtfm::cells
