/// mbtfm-segment: adhesions, stress fibres and outlines of the cells in a picture.
#include <opencv2/core/utility.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/tables.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/stage/stage.h"
#include "segment/cells/cell_rois.h"
#include "segment/cells/contact_sheet.h"
#include "segment/cells/overlay.h"
#include "segment/cells/report.h"
#include "segment/images/stage_images.h"

namespace mbtfm::cells {
namespace {

std::optional<images::Channel> channel(stage::StageContext& context, const std::string& argument,
                                       const images::PlaneChoice& plane, int binning) {
  if (!context.has_input(argument)) return std::nullopt;
  const auto file = context.input(argument);
  return images::read_channel(file.string(), file, plane, binning, context);
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

StageReport run(const SegmentParameters& given, stage::StageContext& context) {
  cv::setNumThreads(context.threads);
  SegmentParameters parameters = given;
  const int binning = parameters.binning;
  if (parameters.pixel_size_um) *parameters.pixel_size_um *= binning;
  const auto adhesion = channel(context, "adhesion-image", parameters.adhesion_plane, binning);
  const auto actin = channel(context, "actin-image", parameters.actin_plane, binning);
  for (const auto* image : {&adhesion, &actin})
    if (*image) images::notice_image(**image, parameters.pixel_size_um, context);
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
  const bool is_one_cell = parameters.cell != 0;
  if (is_one_cell) notice_doubts(cells.front(), parameters, actin.has_value(), context);
  StageReport report = is_one_cell ? report_of(cells.front()) : report_of(cells);
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
