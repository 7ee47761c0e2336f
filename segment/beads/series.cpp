#include "segment/beads/report.h"

#include <algorithm>
#include <functional>
#include <optional>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/names.h"
#include "pipeline/files/tables.h"
#include "segment/beads/pair_look.h"
#include "segment/images/stage_images.h"

namespace mbtfm::beads {

std::vector<Frame> frames_of_file(const fs::path& file, const TrackParameters& parameters) {
  Frame frame{file, parameters.stressed_plane};
  if (parameters.stressed_last == 0) return {frame};
  std::optional<int>& at = frame.plane.page ? frame.plane.page : frame.plane.time;
  if (!at || *at > parameters.stressed_last) {
    throw UsageError("stressed_last = " + std::to_string(parameters.stressed_last) +
                     " needs stressed_time or stressed_page, the first of the time series, which is not after it");
  }
  std::vector<Frame> frames;
  for (; *at <= parameters.stressed_last; ++*at) frames.push_back(frame);
  return frames;
}

namespace {

constexpr const char* kRemedy =
    "do both show the beads of one place, in focus? Check the planes, detection_snr, and effects.drift_affine if one "
    "is "
    "turned";

TrackedFrame tracked(const images::Channel& relaxed, const RelaxedBeads& beads, const Frame& frame,
                     const TrackParameters& parameters, int binning, const std::optional<Placement>& cell,
                     const Progress& progress, stage::StageContext& context) {
  const images::Channel stressed = images::read_channel(frame.name(), frame.file, frame.plane, binning, context);
  images::require_equal_sizes(relaxed, stressed);
  const double pixel_size_um = images::common_pixel_size_um(relaxed, stressed, parameters.pixel_size_um);
  for (const images::Channel* image : {&relaxed, &stressed})
    images::notice_image(*image, parameters.pixel_size_um, context);
  if (stressed.image.pixels == relaxed.image.pixels)
    throw InputError(relaxed.name + ", " + stressed.name, "two images", "the same pixels in both",
                     "give the other picture as --stressed or --relaxed");
  Tracking tracking = with_names(relaxed.name + ", " + stressed.name, kRemedy,
                                 [&] { return beads.track(stressed.image, pixel_size_um, progress, cell); });
  images::Picture picture = picture_of_beads(relaxed.image, stressed.image, tracking.stressed, parameters.cell_with);
  const Vec2 middle_px{0.5 * (relaxed.image.width - 1), 0.5 * (relaxed.image.height - 1)};
  return {std::move(tracking), pixel_size_um, middle_px, std::move(picture)};
}

/// What the page of the cell shows of the images: they lie from (0, 0) on.
void write_picture(stage::StageContext& context, const images::Picture& picture, const images::Image& relaxed,
                   double pixel_size_um) {
  images::write_jpeg(context.output("out", "beads.jpg"), picture);
  files::write(context.output("out", "beads_picture.csv"), files::image_place_table(),
               {{{0, 0}, pixel_size_um * Vec2{double(relaxed.width), double(relaxed.height)}}});
}

files::FrameRow row_of(int frame, const std::string& image, const Tracking& t) {
  return {.frame = frame,
          .image = image,
          .n_tracked = t.n_good,
          .drift_x_um = t.common.drift_um.x,
          .drift_y_um = t.common.drift_um.y,
          .turn_deg = t.common.turn_rad * kRadian_deg,
          .noise_um = t.noise_um,
          .largest_displacement_um = figures_of(t.field).largest_um};
}

/// @param cell  the relaxed picture in the cell's pictures, if these are with another frame
using TrackFrame =
    std::function<TrackedFrame(const Frame&, const std::optional<Placement>& cell, const Progress& progress)>;

/// The first frame that could be tracked stands for the series; one that could not does not stop the others. The cell's
/// pictures are with it (CellWith::stressed).
StageReport track_series(const std::vector<Frame>& frames, CellWith cell_with, stage::StageContext& context,
                         const TrackFrame& tracked_frame) {
  std::vector<files::FrameRow> list;
  std::optional<TrackedFrame> first;
  std::optional<Placement> cell;
  std::vector<InputError> refused;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const int number = static_cast<int>(k) + 1;
    const double n = static_cast<double>(frames.size());
    const Progress progress = [&](double fraction, std::string_view what) {
      context.progress((static_cast<double>(k) + fraction) / n, what);
    };
    try {
      TrackedFrame frame = tracked_frame(frames[k], cell, progress);
      const Tracking& tracking = frame.tracking;
      if (!cell) cell = tracking.stressed;
      const fs::path name = files::displacement_of_frame(number);
      write_field(context, tracking.field, name.stem().string());
      list.push_back(row_of(number, frames[k].name(), tracking));
      if (first) continue;
      write_field(context, tracking.field, "displacement");
      first = std::move(frame);
    } catch (const InputError& error) {
      list.push_back({.frame = number, .image = frames[k].name(), .refused = error.what()});
      refused.push_back(error);
    }
  }
  if (!first) throw refused.front();
  files::write(context.output("out", "frames.csv"), files::frame_table(), list);
  StageReport report = report_of(*first, cell_with, context);
  report.figures.emplace_back("n_frames", static_cast<std::int64_t>(frames.size()));
  report.figures.emplace_back("n_frames_refused", static_cast<std::int64_t>(refused.size()));
  report.summary = std::to_string(frames.size()) + " frames; the first tracked: " + report.summary;
  if (!refused.empty()) {
    report.converged = false;
    report.summary = std::to_string(refused.size()) + " of " + report.summary +
                     "; refused (see frames.csv): " + refused.front().what();
  }
  return report;
}

/// The folder of an earlier run with the same images and parameters, where its list, record and first frame are there.
std::optional<fs::path> earlier_run(const stage::StageContext& context) {
  if (!context.has_input("kept")) return std::nullopt;
  const fs::path folder = context.inputs_.at("kept");
  for (const char* name : {"frames.csv", "displacement.csv", "record.json"})
    if (!fs::is_regular_file(folder / name)) return std::nullopt;
  return folder;
}

/// The bytes as they are.
void keep_field(stage::StageContext& context, const fs::path& folder, const std::string& name) {
  fs::copy_file(folder / name, context.output("out", name));
  write_vtp(context, files::read_displacement(folder / name), fs::path(name).stem().string());
}

/// Track the frames whose files are gone once more. All else, list and report included, is what the earlier run found:
/// from the same images it is the same again.
StageReport complete_series(const std::vector<Frame>& frames, stage::StageContext& context, const fs::path& earlier,
                            const TrackFrame& tracked_frame) {
  keep_field(context, earlier, "displacement.csv");
  std::int64_t n_kept = 0;
  std::optional<Placement> cell;
  std::optional<std::size_t> first;  // the frame of the cell's pictures
  for (const files::FrameRow& row : files::read(earlier / "frames.csv", files::frame_table())) {
    if (row.frame < 1 || row.frame > static_cast<int>(frames.size()))
      throw InputError((earlier / "frames.csv").string(), "frames from 1 to " + std::to_string(frames.size()),
                       std::to_string(row.frame), "remove the folder: it is of another series");
    if (!row.refused.empty()) continue;
    const std::string name = files::displacement_of_frame(row.frame);
    const std::size_t k = static_cast<std::size_t>(row.frame) - 1;
    if (!first) first = k;
    if (fs::is_regular_file(earlier / name)) {
      keep_field(context, earlier, name);
      ++n_kept;
      continue;
    }
    if (!cell && k != *first) cell = tracked_frame(frames.at(*first), {}, context.progress).tracking.stressed;
    const TrackedFrame again = tracked_frame(frames.at(k), k == *first ? std::nullopt : cell, context.progress);
    write_field(context, again.tracking.field, fs::path(name).stem().string());
  }
  fs::copy_file(earlier / "frames.csv", context.output("out", "frames.csv"));
  StageReport report = stage::read_report(earlier / "record.json");
  std::erase_if(report.figures, [](const auto& figure) { return figure.first == "n_frames_kept"; });
  report.figures.emplace_back("n_frames_kept", n_kept);
  return report;
}

/// A pattern is printed on the gel: its mask belongs to the relaxed picture, and lies aside of the cell's by what the
/// stage moved.
void doubt_pattern(const TrackedFrame& frame, CellWith cell_with, stage::StageContext& context) {
  constexpr double kMatters_um = 0.3;  // half an adhesion
  const double shift_um = norm(frame.stage_shift_um());
  if (cell_with == CellWith::relaxed || shift_um < kMatters_um || !context.has_input("adhesions")) return;
  const std::vector<Adhesion> adhesions = files::read_adhesions(context.input("adhesions"));
  if (std::ranges::find(adhesions, AdhesionOrigin::candidate, &Adhesion::origin) == adhesions.end()) return;
  context.notice(noticed(Symptom::assumed_input, 1,
                         {.at = "The stage moved by " + brief(shift_um) +
                                " um. If the pattern's mask lies on the relaxed beads, set images.cell_with = relaxed.",
                          .severity = Severity::caution}));
}

}  // namespace

StageReport run_images(TrackParameters parameters, int binning, const std::vector<Frame>& frames,
                       const FieldModel& model, stage::StageContext& context) {
  if (parameters.pixel_size_um) *parameters.pixel_size_um *= binning;
  parameters.is_series = frames.size() > 1;
  const fs::path relaxed_file = context.input("relaxed");
  const images::Channel relaxed =
      images::read_channel(relaxed_file.string(), relaxed_file, parameters.relaxed_plane, binning, context);
  if (parameters.pixel_size_um) context.notice(images::noticed_unchecked({&relaxed}, *parameters.pixel_size_um));
  const RelaxedBeads beads = with_names(
      relaxed.name, kRemedy, [&] { return RelaxedBeads(relaxed.image, parameters, context.threads, model); });
  const auto tracked_frame = [&](const Frame& frame, const std::optional<Placement>& cell, const Progress& progress) {
    return tracked(relaxed, beads, frame, parameters, binning, cell, progress, context);
  };
  const std::optional<fs::path> earlier = earlier_run(context);
  if (earlier && files::read(*earlier / "frames.csv", files::frame_table()).size() == frames.size())
    return complete_series(frames, context, *earlier, tracked_frame);
  if (frames.size() > 1) return track_series(frames, parameters.cell_with, context, tracked_frame);
  const TrackedFrame frame = tracked_frame(frames.front(), {}, context.progress);
  const Tracking& tracking = frame.tracking;
  doubt_pattern(frame, parameters.cell_with, context);
  if (!tracking.windows.is_on) {
    context.expect_plausible("beads_per_um2", beads_per_um2(tracking.field));
    context.expect_plausible("bead_sigma_um", tracking.bead_sigma_um);
  }
  write_field(context, tracking.field, "displacement");
  if (!tracking.lattice.empty()) files::write_displacement(context.output("out", "windows.csv"), tracking.lattice);
  write_picture(context, frame.picture, relaxed.image, frame.pixel_size_um);
  StageReport report = report_of(frame, parameters.cell_with, context);
  if (parameters.windows_spacing_um > 0 && tracking.lattice.empty())
    report.summary += "; no windows.csv: the images show no texture to follow";
  return report;
}

}  // namespace mbtfm::beads
