#include "segment/cells/report.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/order_statistics.h"
#include "segment/cells/usual_sizes.h"

namespace mbtfm::cells {
namespace {

/// A cell takes the place and the shape of the pattern that it sits on: less than half of it beneath the cell is
/// another place.
bool is_pattern_beside(const Segmentation& s) {
  constexpr double kHalf = 0.5;
  return s.pattern && s.pattern->beneath && *s.pattern->beneath < kHalf;
}

/// Where forces act if no adhesions were seen; empty: they were.
std::string places_of_candidates(const Segmentation& s) {
  switch (s.source) {
    case AdhesionSource::image:
    case AdhesionSource::none:
      return "";
    case AdhesionSource::pattern:
      return "all over the adhesive pattern under the cell" +
             (is_pattern_beside(s) ? "; only " + brief(100 * *s.pattern->beneath) +
                                         " % of the pattern lies beneath it: does the mask lie on these images?"
                                   : std::string());
    case AdhesionSource::fibre_ends:
      return "at the fibres' ends, of which nobody knows which are held";
    case AdhesionSource::cell:
      return "at the fibres' ends and along the cell's rim; nobody knows which are held";
  }
  throw InternalError("unknown source of adhesions");
}

Severity severity_of(const Segmentation& s) {
  // the pattern is known, and its candidates' places are in the error budget
  return s.source == AdhesionSource::pattern && !is_pattern_beside(s) ? Severity::note : Severity::caution;
}

/// Length of bright actin in no fibre: the diagonals of the crests' boxes, as they hardly bend.
double unexplained_um(const Segmentation& s) {
  double sum = 0;
  for (const Polyline& crest : s.unexplained_um) {
    const auto [low, high] = extent_of(crest);
    sum += norm(high - low);
  }
  return sum;
}

/// "3 adhesions and 2 bright things too small for a cell"
std::string left_out(const Segmentation& s) {
  const auto n_others = static_cast<std::int64_t>(s.left_out_um.size()) - s.n_adhesions_outside;
  std::string text;
  if (s.n_adhesions_outside > 0) text = counted(s.n_adhesions_outside, "adhesions");
  if (n_others > 0)
    text += (text.empty() ? "" : " and ") + counted(n_others, "bright things") + " too small for a cell";
  return text;
}

}  // namespace

void notice_doubts(const Segmentation& s, const SegmentParameters& parameters, bool has_actin,
                   stage::StageContext& context) {
  const auto notice = [&](Symptom symptom, double number, const Shown& shown = {}) {
    context.notice(noticed(symptom, number, shown));
  };
  notice(Symptom::adhesions_long, aspect_ratio(s.cell.adhesions));
  notice(Symptom::bleed_through, s.bleed_through.value_or(0));
  notice(Symptom::bright_actin, unexplained_um(s));
  if (s.alignment)
    notice(Symptom::actin_shift, s.alignment->is_significant() ? 1 : 0,
           {.value = sentence_of(*s.alignment),
            .at = s.is_aligned ? "fibres were moved there" : "fibres were left where they are",
            .severity = s.is_aligned ? Severity::note : Severity::caution});
  notice(has_actin ? Symptom::adhesions_off_actin : Symptom::adhesions_off_outline, s.adhesions_beyond.value_or(0));
  notice(Symptom::outline_reaches_far, s.reach_um);
  notice(Symptom::outline_off_actin, s.outline_off_actin.value_or(0));
  if (s.neck)
    notice(Symptom::cells_touch, s.neck->width_um,
           {.at = "(" + brief(s.neck->at_um.x) + ", " + brief(s.neck->at_um.y) + ")"});
  notice(Symptom::adhesions_left_out, static_cast<double>(s.left_out_um.size()), {.at = left_out(s)});
  const std::vector<Adhesion>& adhesions = s.cell.adhesions;
  const auto candidate = std::ranges::find(adhesions, AdhesionOrigin::candidate, &Adhesion::origin);
  notice(Symptom::adhesions_assumed,
         static_cast<double>(std::ranges::count(adhesions, AdhesionOrigin::candidate, &Adhesion::origin)),
         {.at = places_of_candidates(s) + (parameters.candidates.adhesions ? "" : ", as no image shows any"),
          .severity = severity_of(s)});
  notice(Symptom::fibre_ends_anchored, s.n_anchors);
  if (s.pattern) {
    const bool has_both = candidate != adhesions.end() && s.pattern->part_area_um2 > 0;
    notice(Symptom::pattern_too_fine, has_both ? candidate->area_um2 / s.pattern->part_area_um2 : 0);
    notice(Symptom::pattern_as_cell, s.pattern->of_cell);
  }
  for (const std::string& sentence : s.unused) notice(Symptom::input_not_used, 1, {.at = sentence});
}

std::string types_in_words(const std::vector<Fibre>& fibres) {
  using enum FibreType;
  std::string words;
  for (const FibreType type : {ventral, dorsal, arc, edge, unclassified})
    if (const auto n = std::ranges::count(fibres, type, &Fibre::type); n > 0 || type < edge)
      words += (words.empty() ? "" : ", ") + std::to_string(n) + " " + name_of(type) + (type == arc ? "s" : "");
  return words;
}

StageReport report_of(const Segmentation& s) {
  StageReport report;
  const auto n_of = [&](FibreType type) { return std::int64_t(std::ranges::count(s.cell.fibres, type, &Fibre::type)); };
  double area_um2 = 0, length = 0;
  std::int64_t n_seen = 0;
  for (const Adhesion& a : s.cell.adhesions) {
    if (is_assumed(a.origin)) continue;
    area_um2 += a.area_um2;
    ++n_seen;
  }
  for (const Fibre& f : s.cell.fibres) length += length_um(f.points_um);
  const auto n_adhesions = static_cast<std::int64_t>(s.cell.adhesions.size()),
             n_candidates = n_adhesions - n_seen - s.n_anchors;
  report.figures = {{"pixel_size_um", s.pixel_size_um},
                    {"n_adhesions", n_adhesions},
                    {"n_adhesions_outside", static_cast<std::int64_t>(s.n_adhesions_outside)},
                    {"mean_adhesion_area_um2", n_seen > 0 ? area_um2 / static_cast<double>(n_seen) : 0.0},
                    {"n_anchors", static_cast<std::int64_t>(s.n_anchors)},
                    {"n_candidates", n_candidates},
                    {"adhesions_from", std::string(name_of(s.source))},
                    {"n_ventral", n_of(FibreType::ventral)},
                    {"n_dorsal", n_of(FibreType::dorsal)},
                    {"n_arc", n_of(FibreType::arc)},
                    {"n_edge", n_of(FibreType::edge)},
                    {"n_unclassified", n_of(FibreType::unclassified)},
                    {"fibre_length_um", length},
                    {"cell_area_um2", s.area_um2},
                    {"n_holes", static_cast<std::int64_t>(s.cell.holes_um.size())},
                    {"is_cut_by_border", s.is_cut_by_border},
                    {"n_cells_in_image", static_cast<std::int64_t>(s.n_cells)}};
  if (s.bleed_through) report.figures.emplace_back("bleed_through", *s.bleed_through);
  if (s.alignment) {
    const ChannelAlignment& a = *s.alignment;
    report.figures.insert(report.figures.end(),
                          {{"actin_shift_x_um", a.shift_um.x},
                           {"actin_shift_y_um", a.shift_um.y},
                           {"actin_shift_sigma_um", std::max(a.shift_sigma_um.x, a.shift_sigma_um.y)},
                           {"actin_turn_deg", 180 / std::numbers::pi * a.turn_rad},
                           {"actin_growth", a.growth},
                           {"is_actin_aligned", s.is_aligned}});
  }
  report.summary = (n_seen > 0 || n_adhesions == 0 ? std::to_string(n_seen) + " adhesions, " : "") +
                   (n_candidates > 0 ? std::to_string(n_candidates) + " candidates for adhesions, " : "") +
                   (s.n_anchors > 0 ? std::to_string(s.n_anchors) + " anchors, " : "") +
                   std::to_string(s.cell.fibres.size()) + " fibres (" + types_in_words(s.cell.fibres) + ")";
  if (s.is_cut_by_border) report.summary += "; the image's border cuts the cell";
  if (s.n_cells > 1) report.summary += "; one of " + std::to_string(s.n_cells) + " cells in the image";
  return report;
}

StageReport report_of(const std::vector<Segmentation>& cells) {
  std::int64_t n_adhesions = 0, n_fibres = 0, n_cut = 0;
  for (const Segmentation& s : cells) {
    n_adhesions += static_cast<std::int64_t>(s.cell.adhesions.size());
    n_fibres += static_cast<std::int64_t>(s.cell.fibres.size());
    n_cut += s.is_cut_by_border;
  }
  const auto n_cells = static_cast<std::int64_t>(cells.size());
  return {.summary = std::to_string(n_cells) + " cells, " + std::to_string(n_cut) +
                     " of them cut by the image's border; " + std::to_string(n_adhesions) + " adhesions, " +
                     std::to_string(n_fibres) + " fibres",
          .figures = {{"pixel_size_um", cells.front().pixel_size_um},
                      {"n_cells", n_cells},
                      {"n_cells_cut_by_border", n_cut},
                      {"n_adhesions", n_adhesions},
                      {"n_fibres", n_fibres}},
          .effects = {},
          .findings = {}};
}

void add_drawn_by_hand(StageReport& report, const HandDrawn& drawn) {
  const std::pair<std::string, bool> parts[] = {{"outline", drawn.outline.has_value()},
                                                {"adhesions", drawn.adhesions.has_value()},
                                                {"fibres", drawn.fibres.has_value()}};
  for (const auto& [part, is_drawn] : parts) {
    report.figures.emplace_back(part + "_drawn_by_hand", is_drawn);
    if (is_drawn) report.summary += "; " + part + " drawn by hand";
  }
  report.figures.emplace_back("outline_from_mask", drawn.outline_mask && !drawn.outline);
  report.figures.emplace_back("adhesions_from_mask", drawn.adhesion_mask && !drawn.adhesions);
}

void expect_plausible(stage::StageContext& context, const Segmentation& s) {
  context.expect_plausible("cell_area_um2", s.area_um2);
  std::vector<double> areas_um2;
  for (const Adhesion& a : s.cell.adhesions)
    if (!is_assumed(a.origin)) areas_um2.push_back(a.area_um2);
  if (areas_um2.empty()) return;
  context.expect_plausible("adhesion_area_um2", numerics::median_in(areas_um2));
}

std::optional<Finding> noticed_unchecked(std::initializer_list<const std::optional<images::Channel>*> channels,
                                         double pixel_size_um, const Segmentation& s) {
  std::vector<const images::Channel*> seen;
  for (const auto* channel : channels)
    if (*channel) seen.push_back(&**channel);
  std::optional<Finding> found = images::noticed_unchecked(seen, pixel_size_um);
  const SizeRatio size = size_ratio(s);
  constexpr double kDoubtful = 2;  // sd: cells of other kinds, one in twenty
  if (!found || std::abs(size.z) < kDoubtful) return found;
  return noticed(Symptom::pixel_size_unchecked, 1,
                 {.value = brief(pixel_size_um),
                  .at = "cell, adhesions and fibres are " + brief(size.ratio > 1 ? size.ratio : 1 / size.ratio) +
                        " times as " + (size.ratio > 1 ? "large" : "small") + " as usual",
                  .severity = Severity::caution});
}

}  // namespace mbtfm::cells
