#include <algorithm>
#include <cmath>
#include <functional>
#include <memory>
#include <numbers>
#include <opencv2/core/utility.hpp>

#include "mbtfm/tractions/field_of_adhesions.h"
#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/with_error.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/named_array.h"
#include "pipeline/files/names.h"
#include "pipeline/files/own_files.h"
#include "pipeline/files/tables.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/stage/effects.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"
#include "segment/beads/given_field.h"
#include "segment/beads/pair_look.h"
#include "segment/beads/track.h"
#include "segment/images/channels.h"
#include "segment/stacks/run.h"
#include "segment/survey/roles.h"

namespace mbtfm::beads {
namespace {

constexpr double kRadian_deg = 180 / std::numbers::pi;

void write_field_vtp(stage::StageContext& context, const DisplacementField& field, const std::string& name) {
  files::write_points_vtp(
      context.output("out", name + ".vtp"), points_of(field),
      {files::array_of("displacement_um", field, &Bead::displacement_um),
       files::array_of("sigma_um", field, &Bead::sigma_um),
       files::array_of("is_good", field, [](const Bead& bead) { return bead.flag.empty() ? 1 : 0; })});
}

void write_field(stage::StageContext& context, const DisplacementField& field, const std::string& name) {
  files::write_displacement(context.output("out", name + ".csv"), field);
  write_field_vtp(context, field, name);
}

struct FieldFigures {
  std::int64_t n_good = 0, n_moving = 0, n_surely_moving = 0;  ///< by more than three and six standard errors
  double largest_um = 0, sigma_um = 0;
};

FieldFigures figures_of(const DisplacementField& field) {
  FieldFigures result;
  double squares = 0;
  for (const Bead& bead : field) {
    if (!bead.flag.empty()) continue;
    ++result.n_good;
    if (norm(bead.displacement_um) > 3 * bead.sigma_um) ++result.n_moving;
    if (norm(bead.displacement_um) > 6 * bead.sigma_um) ++result.n_surely_moving;
    result.largest_um = std::max(result.largest_um, norm(bead.displacement_um));
    squares += bead.sigma_um * bead.sigma_um;
  }
  result.sigma_um = std::sqrt(squares / static_cast<double>(std::max<std::int64_t>(1, result.n_good)));
  return result;
}

/// Figures and the last line that any field has, tracked or given.
StageReport report_of(const DisplacementField& field) {
  const FieldFigures figures = figures_of(field);
  const auto n_flagged = static_cast<std::int64_t>(field.size()) - figures.n_good;
  StageReport report;
  report.figures = {{"n_beads", static_cast<std::int64_t>(field.size())},
                    {"n_tracked", figures.n_good},
                    {"n_moving", figures.n_moving},
                    {"largest_displacement_um", figures.largest_um},
                    {"sigma_um", figures.sigma_um},
                    {"outwardness", outwardness(field)}};
  if (n_flagged > 0) report.summary += "; " + std::to_string(n_flagged) + " flagged in displacement.csv";
  const double still =
      1 - static_cast<double>(figures.n_surely_moving) / static_cast<double>(std::max<std::int64_t>(1, figures.n_good));
  for (std::optional<Finding> found :
       {noticed(Symptom::nothing_moves, still,
                {.value = std::to_string(figures.n_surely_moving) + " of " + std::to_string(figures.n_good)}),
        noticed(Symptom::moves_outward, outwardness(field))})
    if (found) report.findings.push_back(std::move(*found));
  return report;
}

void add_figures(StageReport& report, const CommonMotion& c) {
  const Figures figures = {{"drift_x_um", c.drift_um.x},
                           {"drift_y_um", c.drift_um.y},
                           {"drift_sigma_um", c.drift_sigma_um},
                           {"turn_deg", c.turn_rad * kRadian_deg},
                           {"turn_sigma_deg", c.turn_sigma_rad * kRadian_deg},
                           {"growth", c.growth},
                           {"growth_sigma", c.growth_sigma},
                           {"shear", c.shear},
                           {"shear_angle_deg", c.shear_angle_rad * kRadian_deg},
                           {"shear_sigma", c.shear_sigma},
                           {"has_far_field", c.has_far_field},
                           {"share_at_rest", c.share_at_rest},
                           {"share_of_border_moving", c.share_of_border_moving},
                           {"share_of_border_pulled", c.share_of_border_pulled},
                           {"pull_of_border", c.pull_of_border}};
  report.figures.insert(report.figures.end(), figures.begin(), figures.end());
}

/// What the images themselves call for.
std::vector<Finding> findings_of(const Tracking& tracking) {
  std::vector<Finding> findings;
  const auto add = [&](std::optional<Finding> found) {
    if (found) findings.push_back(std::move(*found));
  };
  if (tracking.windows.is_on && tracking.windows.setting == Switch::automatic) {
    add(noticed(Symptom::tracked_by_correlation, 1,
                {.value = brief(tracking.window_um), .at = "as " + tracking.windows.why}));
  }
  if (tracking.n_windows > 0) {
    add(noticed(Symptom::tracked_by_correlation, 1,
                {.value = brief(tracking.window_um),
                 .at = "where single beads cannot be: " + brief(100 * tracking.share_of_gaps) + " % of the image"}));
  }
  const BeadSizes& sizes = tracking.sizes;
  const double ratio = sizes.ratio, larger = std::max(ratio, 1 / ratio);
  constexpr double kCertain = 3;  // standard errors
  if (std::abs(ratio - 1) > kCertain * sizes.sigma) {
    add(noticed(Symptom::defocused, larger,
                {.value = with_error(larger, sizes.sigma * larger / ratio), .at = ratio > 1 ? "stressed" : "relaxed"}));
  }
  if (sizes.elongation - 1 > kCertain * sizes.elongation_sigma) {
    const double angle_deg = 180 / std::numbers::pi * sizes.angle_rad;
    add(noticed(
        Symptom::beads_not_round, sizes.elongation,
        {.value = with_error(sizes.elongation, sizes.elongation_sigma),
         .at = brief(std::round(angle_deg < 0 ? angle_deg + 180 : angle_deg)) + " degrees (0: rows, 90: columns)" +
               (sizes.is_of_pixels ? ", by pixels that are not square" : ""),
         .severity = sizes.is_of_pixels ? Severity::caution : Severity::note}));
  }
  return findings;
}

/// Both images may be out of focus alike, which their ratio does not show. Diameter d of spheres that are as wide as
/// the beads in focus: the variance of a sphere's light along an axis is d²/20, and that of the lens's spot is added. A
/// user knows d, and the images do not: large beads in focus look the same.
double diameter_in_focus_um(double bead_sigma_um, double pixel_size_um) {
  // 0.21 wavelengths over an aperture of 0.75; cameras behind lenses of 10 to 100 times have a spot of 0.6 to 1.2
  // pixels
  const double lens_um = std::max(0.15, 1.2 * pixel_size_um);
  return std::sqrt(20 * std::max(0.0, bead_sigma_um * bead_sigma_um - lens_um * lens_um));
}

struct TrackedFrame {
  Tracking tracking;
  double pixel_size_um = 0;
  Vec2 middle_px;           ///< of the images
  images::Picture picture;  ///< of both images
};

StageReport report_of(const TrackedFrame& frame, CellWith cell_with) {
  const auto& [tracking, pixel_size_um, middle_px, picture] = frame;
  StageReport report = report_of(tracking.field);
  const bool has_windows = tracking.windows.is_on;
  const Vec2 shift_um = pixel_size_um * (tracking.stressed.of(middle_px) - middle_px);
  report.summary = std::to_string(tracking.n_good) + " of " + std::to_string(tracking.field.size()) +
                   (has_windows ? " windows tracked" : " beads tracked") + report.summary;
  if (norm(shift_um) > pixel_size_um) {
    report.summary += "; the stage moved by " + brief(norm(shift_um)) + " um, places are those of the " +
                      (cell_with == CellWith::relaxed ? "relaxed" : "stressed") + " image";
  }
  for (Finding& finding : findings_of(tracking)) report.findings.push_back(std::move(finding));
  if (auto found = noticed(Symptom::beads_wide, diameter_in_focus_um(tracking.bead_sigma_um, pixel_size_um)))
    report.findings.push_back(std::move(*found));
  if (tracking.period_um > 0) {
    const double farthest_um = std::max(norm(shift_um), figures_of(tracking.field).largest_um);
    auto found = noticed(Symptom::pattern_repeats, farthest_um / tracking.period_um);
    if (found) report.findings.push_back(std::move(*found));
  }
  const Figures more = {{"cell_with", std::string(name_of(cell_with))},
                        {"stage_shift_x_um", shift_um.x},
                        {"stage_shift_y_um", shift_um.y},
                        {"stage_turn_deg", tracking.stressed.turn_rad() * kRadian_deg},
                        {"pixel_size_um", pixel_size_um},
                        {"n_beads_stressed", static_cast<std::int64_t>(tracking.n_beads_stressed)},
                        {"bead_sigma_um", tracking.bead_sigma_um},
                        {"far_field_residual_um", tracking.far_field_rms_um},
                        {"noise_um", tracking.noise_um},
                        {"scatter_um", tracking.scatter_um},
                        {"method", std::string(name_of(has_windows ? TrackMethod::correlation : TrackMethod::beads))},
                        {"window_sigma_um", tracking.window_um},
                        {"n_windows_in_gaps", static_cast<std::int64_t>(tracking.n_windows)},
                        {"share_of_gaps", tracking.share_of_gaps},
                        {"pattern_period_um", tracking.period_um},
                        {"bead_size_ratio", tracking.sizes.ratio},
                        {"bead_size_ratio_sigma", tracking.sizes.sigma},
                        {"bead_elongation", tracking.sizes.elongation},
                        {"bead_elongation_sigma", tracking.sizes.elongation_sigma}};
  report.figures.insert(report.figures.end(), more.begin(), more.end());
  add_figures(report, tracking.common);
  report.effects = {tracking.affine, tracking.windows};
  return report;
}

/// A stressed image.
struct Frame {
  fs::path file;
  images::PlaneChoice plane;
  std::string name() const {
    const std::string image = file.filename().string();
    if (plane.page) return image + ", page " + std::to_string(*plane.page);
    return image + (plane.time ? ", time " + std::to_string(*plane.time) : "");
  }
};

/// The frames or pages of a file from the chosen one to the last.
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

/// The images of a folder in the order of their names, numbers as numbers, or those of a file.
std::vector<Frame> frames_of(stage::StageContext& context, const TrackParameters& parameters) {
  const fs::path& given = context.inputs_.at("stressed");
  if (!files::is_folder(given)) return frames_of_file(context.input("stressed"), parameters);
  const std::vector<std::string> names = survey::images_in(given);
  if (names.empty()) throw InputError(given.string(), "images (.tif, .tiff, .png, .jpg, .jpeg)", "none");
  context.input("stressed", names);
  std::vector<Frame> frames;
  for (const std::string& name : names) frames.push_back({given / name, parameters.stressed_plane});
  return frames;
}

/// @throws InputError naming the images where they cannot be tracked
template <class Body>
auto with_names(const std::string& names, const Body& body) {
  try {
    return body();
  } catch (const ExchangedImages& error) {
    throw InputError(
        names + ": " + error.element, error.expected, error.found,
        "exchange the files of --stressed and --relaxed; if the cell does push outward, set track.may_push = true");
  } catch (const NotFollowed& error) {
    throw InputError(
        names + ": " + error.element, error.expected, error.found,
        error.hint.empty()
            ? "do both show the beads of one place, in focus? Check the planes; neither windows (track.method), "
              "track.largest_displacement_um, track.detection_snr nor effects.drift_affine made them fit"
            : "tried out, this helps: " + error.hint);
  } catch (const InvalidData& error) {
    throw InputError(names + ": " + error.element, error.expected, error.found,
                     "do both show the beads of one place, in focus? Check the planes, detection_snr, and "
                     "effects.drift_affine if one is turned");
  }
}

/// As the beads were, each row where it belongs.
images::Channel channel_of(const std::string& name, const fs::path& file, const images::PlaneChoice& plane, int binning,
                           stage::StageContext& context) {
  images::Channel channel{name, images::read_image(file, plane)};
  context.notice(images::take_scan_phase_off(channel));
  channel.image = images::binned(std::move(channel.image), binning);
  return channel;
}

/// @param cell  the relaxed picture in the cell's pictures, if these are with another frame
TrackedFrame tracked(const images::Channel& relaxed, const RelaxedBeads& beads, const Frame& frame,
                     const TrackParameters& parameters, int binning, const std::optional<Placement>& cell,
                     const Progress& progress, stage::StageContext& context) {
  const images::Channel stressed = channel_of(frame.name(), frame.file, frame.plane, binning, context);
  images::require_equal_sizes(relaxed, stressed);
  const double pixel_size_um = images::common_pixel_size_um(relaxed, stressed, parameters.pixel_size_um);
  for (const images::Channel* image : {&relaxed, &stressed}) {
    context.doubt(images::doubt_about_calibration(*image, parameters.pixel_size_um), image->name + ": pixel_size_um");
    for (const std::optional<Finding>& found : images::noticed_in(*image)) context.notice(found);
  }
  if (stressed.image.pixels == relaxed.image.pixels)
    throw InputError(relaxed.name + ", " + stressed.name, "two images", "the same pixels in both",
                     "give the other picture as --stressed or --relaxed");
  Tracking tracking = with_names(relaxed.name + ", " + stressed.name,
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

/// Of a gel that the adhesions pull, where they are given.
FieldModel model_of_gel(stage::StageContext& context) {
  if (!context.has_input("adhesions")) return {};
  const auto field =
      std::make_shared<tractions::FieldOfAdhesions>(files::read_adhesions(context.input("adhesions")), context.threads);
  return [field](const DisplacementField& beads) { return field->um(beads); };
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
  std::optional<StageReport> first;
  std::optional<Placement> cell;
  std::vector<InputError> refused;
  for (std::size_t k = 0; k < frames.size(); ++k) {
    const int number = static_cast<int>(k) + 1;
    const double n = static_cast<double>(frames.size());
    const Progress progress = [&](double fraction, std::string_view what) {
      context.progress((static_cast<double>(k) + fraction) / n, what);
    };
    try {
      const TrackedFrame frame = tracked_frame(frames[k], cell, progress);
      const Tracking& tracking = frame.tracking;
      if (!cell) cell = tracking.stressed;
      const fs::path name = files::displacement_of_frame(number);
      write_field(context, tracking.field, name.stem().string());
      list.push_back(row_of(number, frames[k].name(), tracking));
      if (first) continue;
      write_field(context, tracking.field, "displacement");
      first = report_of(frame, cell_with);
    } catch (const InputError& error) {
      list.push_back({.frame = number, .image = frames[k].name(), .refused = error.what()});
      refused.push_back(error);
    }
  }
  if (!first) throw refused.front();
  files::write(context.output("out", "frames.csv"), files::frame_table(), list);
  StageReport& report = *first;
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
  write_field_vtp(context, files::read_displacement(folder / name), fs::path(name).stem().string());
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
  const double shift_um = frame.pixel_size_um * norm(frame.tracking.stressed.of(frame.middle_px) - frame.middle_px);
  if (cell_with == CellWith::relaxed || shift_um < kMatters_um || !context.has_input("adhesions")) return;
  const std::vector<Adhesion> adhesions = files::read_adhesions(context.input("adhesions"));
  if (std::ranges::find(adhesions, AdhesionOrigin::candidate, &Adhesion::origin) == adhesions.end()) return;
  context.notice(noticed(Symptom::assumed_input, 1,
                         {.at = "The stage moved by " + brief(shift_um) +
                                " um. If the pattern's mask lies on the relaxed beads, set images.cell_with = relaxed.",
                          .severity = Severity::caution}));
}

StageReport track(TrackParameters parameters, int binning, stage::StageContext& context) {
  if (parameters.pixel_size_um) *parameters.pixel_size_um *= binning;
  const std::vector<Frame> frames = frames_of(context, parameters);
  parameters.is_series = frames.size() > 1;
  const fs::path relaxed_file = context.input("relaxed");
  const images::Channel relaxed =
      channel_of(relaxed_file.string(), relaxed_file, parameters.relaxed_plane, binning, context);
  if (parameters.pixel_size_um) context.notice(images::noticed_unchecked({&relaxed}, *parameters.pixel_size_um));
  const RelaxedBeads beads = with_names(
      relaxed.name, [&] { return RelaxedBeads(relaxed.image, parameters, context.threads, model_of_gel(context)); });
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
  StageReport report = report_of(frame, parameters.cell_with);
  if (parameters.windows_spacing_um > 0 && tracking.lattice.empty())
    report.summary += "; no windows.csv: the images show no texture to follow";
  return report;
}

struct TrackStageParameters {
  TrackParameters track;
  stacks::StackParameters in_space;
  images::PlaneChoice surface_plane;
  int binning = 1;  ///< to be quick: beads closer than a few pixels of the reduced images are lost
  stage::EffectSwitches effects;
};

void declare(stage::ParameterList& list, TrackStageParameters& p) {
  declare(list, p.track);
  list.table("track");
  list.add("binning", p.binning, Range::between(1, images::kLargestBinning));
  declare(list, p.in_space);
  declare(list, p.surface_plane, "surface");
  declare(list, p.effects, {"drift_affine", "effect_tolerance"});
}

/// What may have moved the image, as the switches say.
TrackParameters switched(const TrackStageParameters& given) {
  TrackParameters parameters = given.track;
  parameters.drift_affine = given.effects.drift_affine;
  parameters.effect_tolerance = given.effects.effect_tolerance;
  if (parameters.beads_pixel_size_um) parameters.pixel_size_um = parameters.beads_pixel_size_um;
  return parameters;
}

/// What is wrong with the images at first sight.
void look(const TrackStageParameters& given, stage::StageContext& context) {
  if (!context.has_input("cell_image") || !context.has_input("relaxed")) return;
  const auto field = [&](const char* name, std::optional<double> pixel_size_um) {
    const fs::path file = context.input(name);
    images::NamedField result{.name = file.string(), .field = images::read_field(file)};
    if (pixel_size_um) result.field.pixel_size_um = pixel_size_um;
    return result;
  };
  images::require_same_field(field("cell_image", given.track.pixel_size_um),
                             field("relaxed", switched(given).pixel_size_um));
}

StageReport run(const TrackStageParameters& given, stage::StageContext& context) {
  const TrackParameters parameters = switched(given);
  look(given, context);
  cv::setNumThreads(context.threads);
  const bool has_images = context.has_input("stressed") || context.has_input("relaxed");
  if (context.has_input("displacement")) {
    if (has_images) throw UsageError("--displacement and bead images exclude each other");
    std::optional<images::ImageField> picture;
    if (context.has_input("cell_image")) picture = images::read_field(context.input("cell_image"));
    GivenField table = read_given_field(context.input("displacement"), parameters, picture);
    DisplacementField& field = table.field;
    context.expect_plausible("beads_per_um2", beads_per_um2(field));
    const GivenMotion motion = take_motion_off(field, parameters);
    write_field(context, field, "displacement");
    StageReport report = report_of(field);
    add_figures(report, motion.common);
    report.effects = {motion.affine};
    report.figures.emplace_back("table", std::string(name_of(table.form)));
    std::ranges::move(table.findings, std::back_inserter(report.findings));
    if (motion.unplaced_um) {
      report.findings.push_back(*noticed(
          Symptom::assumed_input, 1,
          {.at = "The table holds a drift of " + brief(*motion.unplaced_um) +
                 " um. Its places are read as the cell's; if they are the relaxed image's, set track.places = relaxed.",
           .severity = Severity::caution}));
    }
    report.summary = std::to_string(field.size()) + " displacements read" + table.how + report.summary;
    if (table.n_left_out > 0) report.summary += "; " + counted(table.n_left_out, "rows") + " without a place left out";
    return report;
  }
  for (const char* name : {"stressed", "relaxed"})
    if (!context.has_input(name))
      throw UsageError("--" + std::string(name) + " is missing: the two bead images, or --displacement");
  if (stacks::are_in_space(parameters, given.in_space))
    return stacks::run(parameters, given.surface_plane, given.in_space, context);
  return track(parameters, given.binning, context);
}

}  // namespace
}  // namespace mbtfm::beads

int main(int argc, char** argv) {
  using mbtfm::stage::FileArgument;
  using Kind = FileArgument::Kind;
  return mbtfm::stage::run_stage<mbtfm::beads::TrackStageParameters>(
      {.name = "track",
       .files = {{"stressed", Kind::optional_input, false, "beads_stressed"},
                 {"relaxed", Kind::optional_input, false, "beads_relaxed"},
                 {"surface_beads", Kind::optional_input},
                 {"adhesions", Kind::optional_input},
                 {"displacement", Kind::optional_input, false, "displacement"},
                 {"cell_image", Kind::optional_input},
                 {"kept", Kind::optional_input},
                 {"out", Kind::output_folder}}},
      argc, argv, mbtfm::beads::run, mbtfm::beads::look);
}
