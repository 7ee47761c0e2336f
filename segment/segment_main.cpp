#include <algorithm>
#include <numbers>
#include <opencv2/core/utility.hpp>

#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/tables.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/stage/stage.h"
#include "segment/cells/cell_rois.h"
#include "segment/cells/contact_sheet.h"
#include "segment/cells/overlay.h"
#include "segment/cells/segment_cell.h"
#include "segment/cells/usual_sizes.h"
#include "segment/images/channels.h"

namespace mbtfm::cells {
namespace {

std::optional<images::Channel> channel(stage::StageContext& context, const std::string& argument,
                                       const images::PlaneChoice& plane, int binning) {
  if (!context.has_input(argument)) return std::nullopt;
  const auto file = context.input(argument);
  images::Channel result{file.string(), images::read_image(file, plane)};
  context.notice(images::take_scan_phase_off(result));
  result.image = binned(std::move(result.image), binning);
  return result;
}

std::optional<RoiSet> roi_set(stage::StageContext& context, const std::string& argument, int binning) {
  if (!context.has_input(argument)) return std::nullopt;
  const auto file = context.input(argument);
  RoiSet set{file.string(), rois::read_rois(file)};
  for (rois::Roi& roi : set.rois) roi = binned(std::move(roi), binning);
  return set;
}

std::shared_ptr<const LabelMask> mask(stage::StageContext& context, const std::string& argument, int binning) {
  if (!context.has_input(argument)) return nullptr;
  LabelMask mask = read_mask(context.input(argument));
  context.notice(
      noticed(Symptom::assumed_input, mask.taken.empty() ? 0 : 1, {.at = mask.name + ": " + mask.taken + "."}));
  mask.binning = binning;
  return std::make_shared<const LabelMask>(std::move(mask));
}

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

std::vector<std::optional<Finding>> findings_of(const PatternAtCell& pattern, const std::vector<Adhesion>& adhesions) {
  const auto candidate = std::ranges::find(adhesions, AdhesionOrigin::candidate, &Adhesion::origin);
  const bool has_both = candidate != adhesions.end() && pattern.part_area_um2 > 0;
  return {noticed(Symptom::pattern_too_fine, has_both ? candidate->area_um2 / pattern.part_area_um2 : 0),
          noticed(Symptom::pattern_as_cell, pattern.of_cell)};
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

StageReport report_of(const Segmentation& s, bool is_assumed_by_itself, bool has_actin) {
  StageReport report;
  const auto n_of = [&](FibreType type) {
    std::int64_t n = 0;
    for (const Fibre& f : s.cell.fibres) n += f.type == type;
    return n;
  };
  double area_um2 = 0, length = 0;
  std::int64_t n_seen = 0;
  for (const Adhesion& a : s.cell.adhesions) {
    if (is_assumed(a.origin)) continue;
    area_um2 += a.area_um2;
    ++n_seen;
  }
  for (const Fibre& f : s.cell.fibres) length += length_um(f.points_um);
  const auto n_adhesions = static_cast<std::int64_t>(s.cell.adhesions.size());
  report.figures = {{"pixel_size_um", s.pixel_size_um},
                    {"n_adhesions", n_adhesions},
                    {"n_adhesions_outside", static_cast<std::int64_t>(s.n_adhesions_outside)},
                    {"mean_adhesion_area_um2", n_seen > 0 ? area_um2 / static_cast<double>(n_seen) : 0.0},
                    {"n_anchors", static_cast<std::int64_t>(s.n_anchors)},
                    {"n_candidates", n_adhesions - n_seen - s.n_anchors},
                    {"adhesions_from", std::string(name_of(s.source))},
                    {"n_ventral", n_of(FibreType::ventral)},
                    {"n_dorsal", n_of(FibreType::dorsal)},
                    {"n_arc", n_of(FibreType::arc)},
                    {"n_edge", n_of(FibreType::edge)},
                    {"n_unclassified", std::int64_t(std::ranges::count_if(s.cell.fibres, is_unclassified))},
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
  const std::int64_t n_candidates = n_adhesions - n_seen - s.n_anchors;
  report.summary = (n_seen > 0 || n_adhesions == 0 ? std::to_string(n_seen) + " adhesions, " : "") +
                   (n_candidates > 0 ? std::to_string(n_candidates) + " candidates for adhesions, " : "") +
                   (s.n_anchors > 0 ? std::to_string(s.n_anchors) + " anchors, " : "") +
                   std::to_string(s.cell.fibres.size()) + " fibres (" + std::to_string(n_of(FibreType::ventral)) +
                   " ventral, " + std::to_string(n_of(FibreType::dorsal)) + " dorsal, " +
                   std::to_string(n_of(FibreType::arc)) + " arcs" +
                   (n_of(FibreType::edge) > 0 ? ", " + std::to_string(n_of(FibreType::edge)) + " edge)" : ")");
  for (std::optional<Finding> found :
       {noticed(Symptom::adhesions_long, cells::aspect_ratio(s.cell.adhesions)),
        noticed(Symptom::bleed_through, s.bleed_through.value_or(0)), noticed(Symptom::bright_actin, unexplained_um(s)),
        noticed(Symptom::actin_shift, s.alignment && s.alignment->is_significant() ? 1 : 0,
                {.value = s.alignment ? sentence_of(*s.alignment) : "",
                .at = s.is_aligned ? "fibres were moved there" : "fibres were left where they are",
                .severity = s.is_aligned ? Severity::note : Severity::caution}),
        noticed(has_actin ? Symptom::adhesions_off_actin : Symptom::adhesions_off_outline,
                s.adhesions_beyond.value_or(0)),
        noticed(Symptom::outline_reaches_far, s.reach_um),
        noticed(Symptom::outline_off_actin, s.outline_off_actin.value_or(0)),
        noticed(Symptom::cells_touch, s.neck ? s.neck->width_um : 0,
                {.at = s.neck ? "(" + brief(s.neck->at_um.x) + ", " + brief(s.neck->at_um.y) + ")" : ""}),
        noticed(Symptom::adhesions_left_out, static_cast<double>(s.left_out_um.size()), {.at = left_out(s)}),
        noticed(Symptom::adhesions_assumed,
                static_cast<double>(std::ranges::count(s.cell.adhesions, AdhesionOrigin::candidate, &Adhesion::origin)),
                {.at = places_of_candidates(s) + (is_assumed_by_itself ? ", as no image shows any" : ""),
                .severity = severity_of(s)}),
        noticed(Symptom::fibre_ends_anchored, s.n_anchors)})
    if (found) report.findings.push_back(std::move(*found));
  if (s.pattern) {
    for (std::optional<Finding>& found : findings_of(*s.pattern, s.cell.adhesions))
      if (found) report.findings.push_back(std::move(*found));
  }
  for (const std::string& sentence : s.unused)
    report.findings.push_back(*noticed(Symptom::input_not_used, 1, {.at = sentence}));
  if (s.is_cut_by_border) report.summary += "; the image's border cuts the cell";
  if (s.n_cells > 1) report.summary += "; one of " + std::to_string(s.n_cells) + " cells in the image";
  return report;
}

/// Of all cells of an image.
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

/// For the eye, for the cell's page, for the study's.
struct CellPictures {
  images::Picture overlay;
  Ground ground;
  images::Picture thumbnail;
};

CellPictures pictures_of(const std::optional<images::Channel>& adhesion, const std::optional<images::Channel>& actin,
                         const Segmentation& s) {
  constexpr int kThumbnail_px = 280;
  return {draw_overlay(adhesion, actin, s), draw_ground(adhesion, actin, s),
          picture_of(draw_thumbnail(adhesion, actin, s, view_of(s), kThumbnail_px))};
}

void write_cell(stage::StageContext& context, const std::string& folder, const Segmentation& s,
                const CellPictures& pictures, int binning) {
  const auto out = [&](const char* file) { return context.output("out", folder + file); };
  files::write_adhesions(out("adhesions.csv"), s.cell.adhesions);
  files::write_fibres(out("fibres.csv"), out("fibre_points.csv"), s.cell.fibres);
  files::write_outline(out("outline.csv"), s.cell.outline_um, s.cell.holes_um, s.cell.is_cut);
  if (const std::vector<Polygon>& others = s.cell.neighbours_um; !others.empty())
    files::write_outline(out(files::kNeighboursFile), others.front(), {others.begin() + 1, others.end()});
  files::write_cell_vtp(out("cell.vtp"), s.cell);
  images::write_png(out("overlay.png"), pictures.overlay);
  images::write_jpeg(out("images.jpg"), pictures.ground.picture);
  images::write_jpeg(out("thumbnail.jpg"), pictures.thumbnail);
  files::write(out("images.csv"), files::image_place_table(), {{pictures.ground.low_um, pictures.ground.size_um}});
  if (s.second) {
    files::write_adhesions(out("adhesions_2.csv"), s.second->adhesions);
    files::write_fibres(out("fibres_2.csv"), out("fibre_points_2.csv"), s.second->fibres);
  }
  rois::write_roi_set(out("RoiSet.zip"), rois_of(s.cell, s.pixel_size_um / binning));  // they lie on the image as it is
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

/// @throws InputError where no cell looks like that
void expect_plausible(stage::StageContext& context, const Segmentation& s) {
  context.expect_plausible("cell_area_um2", s.area_um2);
  std::vector<double> areas_um2;
  for (const Adhesion& a : s.cell.adhesions)
    if (!is_assumed(a.origin)) areas_um2.push_back(a.area_um2);
  if (areas_um2.empty()) return;
  context.expect_plausible("adhesion_area_um2", numerics::median_in(areas_um2));
}

/// A pixel size that no image states is doubted if the cell and its parts are not as large with it as cells are.
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

StageReport run(const SegmentParameters& given, stage::StageContext& context) {
  cv::setNumThreads(context.threads);
  SegmentParameters parameters = given;
  const int binning = parameters.binning;
  if (parameters.pixel_size_um) *parameters.pixel_size_um *= binning;
  const auto adhesion = channel(context, "adhesion-image", parameters.adhesion_plane, binning);
  const auto actin = channel(context, "actin-image", parameters.actin_plane, binning);
  for (const auto& image : {adhesion, actin}) {
    if (!image) continue;
    context.doubt(images::doubt_about_calibration(*image, parameters.pixel_size_um), image->name + ": pixel_size_um");
    for (const std::optional<Finding>& found : images::noticed_in(*image)) context.notice(found);
  }
  const bool is_one = adhesion && actin && adhesion->image.pixels == actin->image.pixels;
  if (is_one && adhesion->name != actin->name) {  // one file for both is by intent: no image of the actin is there
    throw InputError(adhesion->name + ", " + actin->name, "images of adhesions and of actin", "the same pixels in both",
                     "name the right file or channel of each in [images] of cell.toml");
  }
  const HandDrawn drawn{roi_set(context, "outline-roi", binning), roi_set(context, "adhesion-rois", binning),
                        roi_set(context, "fibre-rois", binning), mask(context, "outline-mask", binning),
                        mask(context, "adhesion-mask", binning)};
  const std::vector<Segmentation> cells = segment_cells(adhesion, actin, parameters, drawn);
  for (const Segmentation& s : cells) expect_plausible(context, s);
  if (parameters.pixel_size_um)
    context.notice(noticed_unchecked({&adhesion, &actin}, *parameters.pixel_size_um, cells.front()));
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const std::string folder = parameters.cell == 0 ? "cell_" + std::to_string(i + 1) + "/" : "";
    write_cell(context, folder, cells[i], pictures_of(adhesion, actin, cells[i]), binning);
  }
  if (!parameters.contact_sheet.empty())
    images::write_png(context.output("out", "contact_sheet.png"),
                      draw_contact_sheet(adhesion, actin, parameters, drawn));
  StageReport report = parameters.cell == 0
                           ? report_of(cells)
                           : report_of(cells.front(), !parameters.candidates.adhesions, actin.has_value());
  add_drawn_by_hand(report, drawn);
  return report;
}

}  // namespace

}  // namespace mbtfm::cells

int main(int argc, char** argv) {
  using mbtfm::stage::FileArgument;
  return mbtfm::stage::run_stage<mbtfm::cells::SegmentParameters>(
      {.name = "segment",
       .files = {{"adhesion-image", FileArgument::Kind::optional_input},
                 {"actin-image", FileArgument::Kind::optional_input},
                 {"outline-roi", FileArgument::Kind::optional_input},
                 {"adhesion-rois", FileArgument::Kind::optional_input},
                 {"fibre-rois", FileArgument::Kind::optional_input},
                 {"outline-mask", FileArgument::Kind::optional_input},
                 {"adhesion-mask", FileArgument::Kind::optional_input, false, "adhesion_mask"},
                 {"out", FileArgument::Kind::output_folder}}},
      argc, argv, mbtfm::cells::run);
}
