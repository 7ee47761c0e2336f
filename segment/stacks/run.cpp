#include "segment/stacks/run.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/text.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/stage/parameters.h"
#include "segment/beads/report.h"
#include "segment/images/channels.h"

namespace mbtfm::stacks {

double rms_drift_um(const CommonMotion& c) {
  double sum = 0;
  for (const Vec2& s : c.slices_um) sum += dot(s, s);
  return c.slices_um.empty() ? 0 : std::sqrt(sum / (2.0 * static_cast<double>(c.slices_um.size())));
}

std::int64_t count(const Followed& f, TrackFlag flag) {
  const auto found = f.flags.find(name_of(flag));
  return found == f.flags.end() ? 0 : found->second;
}

double share_followed(const Followed& f) {
  const std::int64_t inside = static_cast<std::int64_t>(f.field.size()) - count(f, TrackFlag::edge);
  return static_cast<double>(f.n_good) / static_cast<double>(std::max<std::int64_t>(1, inside));
}

double WidthRatio::larger() const { return std::max({across, 1 / across, along, 1 / along}); }

WidthRatio width_ratio(const Detection& relaxed, const Detection& stressed) {
  const Widths a = relaxed.widths_in_the_middle(), b = stressed.widths_in_the_middle();
  return {b.xy / a.xy, b.z / a.z};
}

std::vector<Finding> findings_of(const Followed& f, const WidthRatio& widths, double saturated) {
  std::vector<Finding> findings;
  const auto add = [&](std::optional<Finding> found) {
    if (found) findings.push_back(std::move(*found));
  };
  add(noticed(Symptom::saturated, saturated, {.at = "A stack"}));
  add(beads::noticed_stillness(beads::figures_of(f.field)));
  add(noticed(Symptom::beads_lost, 1 - share_followed(f),
              {.at = std::to_string(count(f, TrackFlag::no_partner)) + " have no partner, " +
                     std::to_string(count(f, TrackFlag::ambiguous)) + " more than one, " +
                     std::to_string(count(f, TrackFlag::neighbours_disagree)) + " contradict their neighbours"}));
  add(noticed(Symptom::little_at_rest, 1 - f.common.share_at_rest));
  add(noticed(Symptom::slices_moved, f.common.slice_drift_ratio,
              {.value = brief(rms_drift_um(f.common)),
               .at = f.common.has_slice_drift ? "it was taken off" : "it was not taken off"}));
  add(noticed(Symptom::beads_scatter, std::max(f.error_ratio, f.error_ratio_z)));
  add(noticed(Symptom::defocused, widths.larger(), {.at = widths.across * widths.along > 1 ? "stressed" : "relaxed"}));
  if (f.light_ratio > 0) add(noticed(Symptom::light_lost, 1 - std::min(f.light_ratio, 1 / f.light_ratio)));
  return findings;
}

namespace {

/// What must be the same of two stacks.
struct Frame {
  std::string name;
  int width = 0, height = 0, depth = 0;
  std::optional<double> pixel_um, step_um;
  std::string size() const {
    return std::to_string(width) + " x " + std::to_string(height) + " pixels x " + std::to_string(depth) + " slices";
  }
};

Frame frame_of(const std::string& name, const std::vector<images::Image>& slices) {
  const images::Image& first = slices.front();
  return {name, first.width, first.height, static_cast<int>(slices.size()), first.pixel_size_um, first.z_step_um};
}

void require_same_size(const Frame& first, const Frame& other) {
  if (first.size() == other.size()) return;
  throw InputError(other.name, first.size() + " as in " + first.name, other.size(),
                   "both stacks must show the same field at the same magnification and depths; cut the longer one in "
                   "ImageJ (Image > Stacks > Tools > Make Substack)");
}

void require_slices(const Frame& frame) {
  if (frame.depth >= kFewestSlices) return;
  throw InputError(frame.name, "a stack of " + std::to_string(kFewestSlices) + " slices or more",
                   std::to_string(frame.depth), "set track.dimensions = plane to follow beads in the plane");
}

constexpr double kSame = 2e-3;  // calibrations are written with three digits or more

double step_um(const Frame& first, const Frame& other, const StackParameters& p) {
  if (p.z_step_um) return *p.z_step_um;
  if (first.step_um && other.step_um && std::abs(*first.step_um - *other.step_um) > kSame * *first.step_um) {
    throw InputError(other.name, "the distance of slices of " + first.name + ", " + images::in_um(*first.step_um),
                     images::in_um(*other.step_um), "set track.z_step_um to the right one");
  }
  if (first.step_um) return *first.step_um;
  if (other.step_um) return *other.step_um;
  throw InputError(
      first.name, "the distance of its slices in the file", "none",
      "set track.z_step_um, the distance of two slices; or track.dimensions = plane for the maximum projection");
}

double pixel_um(const Frame& first, const Frame& other, std::optional<double> given_um) {
  const auto channel = [](const Frame& f) {
    return images::Channel{f.name, {.width = f.width, .height = f.height, .pixels = {}, .pixel_size_um = f.pixel_um}};
  };
  return images::common_pixel_size_um(channel(first), channel(other), given_um);
}

Scale scale_of(const Frame& first, const Frame& other, const beads::TrackParameters& track, const StackParameters& p) {
  return {.pixel_um = pixel_um(first, other, track.pixel_size_um),
          .step_um = step_um(first, other, p) * p.refractive_index_ratio,
          .first_um = p.first_slice_z_um,
          .z_points = *p.z_points,
          .depth = first.depth};
}

struct Read {
  Frame frame;
  Detection detection;
};

void require_direction(const StackParameters& p) {
  if (p.z_points) return;
  throw UsageError(
      "expected track.z_points with stacks: into-gel if slices lead from the surface into the gel, out-of-gel if the "
      "first is the deepest");
}

Read read_and_detect(const fs::path& file, const images::PlaneChoice& plane, const char* which, double detection_snr,
                     const Frame* as, stage::StageContext& context) {
  std::vector<images::Image> slices = images::read_slices(file, plane);
  const Frame frame = frame_of(file.string(), slices);
  require_slices(frame);
  if (as) require_same_size(*as, frame);
  if (const auto lossy = std::ranges::find(slices, true, &images::Image::is_lossy); lossy != slices.end())
    context.notice(images::noticed_loss({file.string(), *lossy}));
  const auto not_finite = [](const images::Image& slice) {
    return std::ranges::any_of(slice.pixels, [](float v) { return !std::isfinite(v); });
  };
  if (std::ranges::any_of(slices, not_finite))
    throw InputError(file.string(), "finite pixel values", "NaN or infinity");
  return {frame, detect(std::move(slices), detection_snr, which, context.threads)};
}

constexpr const char* kRemedy =
    "do both show the beads of one place? Check channels and times, track.detection_snr for weak beads, "
    "track.largest_displacement_um for large motion";

// --- files

void write_slices(stage::StageContext& context, const CommonMotion& common) {
  files::CsvText csv({"z_um", "drift_x_um", "drift_y_um", "sigma_um", "taken_off"});
  for (std::size_t k = 0; k < common.z_um.size(); ++k) {
    csv.add(common.z_um[k]).add(common.slices_um[k].x).add(common.slices_um[k].y).add(common.slices_sigma_um[k]);
    csv.add(common.has_slice_drift ? "TRUE" : "FALSE").end_row();
  }
  files::write_text(context.output("out", "slices.csv"), csv.str());
}

void write_surface_beads(stage::StageContext& context, const std::vector<PlacedBead>& beads) {
  files::CsvText csv({"x_um", "y_um", "z_um", "sigma_um", "sigma_z_um", "flag"});
  for (const PlacedBead& bead : beads) {
    csv.add(bead.position_um.x).add(bead.position_um.y).add(bead.position_um.z);
    csv.add(bead.sigma_um).add(bead.sigma_z_um).add(name_of(bead.flag)).end_row();
  }
  files::write_text(context.output("out", "surface_beads.csv"), csv.str());
}

// --- the report

using beads::kRadian_deg;

StageReport report_of(const Followed& f, const Scale& scale, const Read& relaxed, const Read& stressed) {
  const beads::FieldFigures figures = beads::figures_of(f.field);
  std::vector<double> sigmas, sigmas_z;
  for (const BeadInSpace& bead : f.field)
    if (bead.flag.empty()) sigmas.push_back(bead.sigma_um), sigmas_z.push_back(bead.sigma_z_um);
  const auto median = [](const std::vector<double>& values) { return values.empty() ? 0 : numerics::median(values); };
  const double sigma_um = median(sigmas), sigma_z_um = median(sigmas_z);
  const WidthRatio widths = width_ratio(relaxed.detection, stressed.detection);
  const Vec3 shift = f.first.shift_um + f.common.shift_um;
  StageReport report;
  report.summary = std::to_string(f.n_good) + " of " + std::to_string(f.field.size()) + " beads followed in space; " +
                   std::to_string(f.field.size() - static_cast<std::size_t>(f.n_good)) +
                   " flagged in displacement_3d.csv; standard error " + brief(sigma_um) + " um across, " +
                   brief(sigma_z_um) + " um along z";
  report.figures = {{"n_beads", static_cast<std::int64_t>(f.field.size())},
                    {"n_tracked", static_cast<std::int64_t>(f.n_good)},
                    {"n_beads_stressed", static_cast<std::int64_t>(f.n_stressed)},
                    {"n_moving", figures.n_moving},
                    {"n_no_partner", count(f, TrackFlag::no_partner)},
                    {"n_ambiguous", count(f, TrackFlag::ambiguous)},
                    {"n_neighbours_disagree", count(f, TrackFlag::neighbours_disagree)},
                    {"n_edge", count(f, TrackFlag::edge)},
                    {"n_saturated", count(f, TrackFlag::saturated)},
                    {"share_followed", share_followed(f)},
                    {"largest_displacement_um", figures.largest_um},
                    {"sigma_um", sigma_um},
                    {"sigma_z_um", sigma_z_um},
                    {"neighbours_agree_um", f.neighbours_um},
                    {"neighbours_agree_z_um", f.neighbours_z_um},
                    {"error_ratio", f.error_ratio},
                    {"error_ratio_z", f.error_ratio_z},
                    {"drift_x_um", shift.x},
                    {"drift_y_um", shift.y},
                    {"drift_z_um", shift.z},
                    {"drift_sigma_um", f.common.shift_sigma_um.x},
                    {"drift_sigma_z_um", f.common.shift_sigma_um.z},
                    {"turn_deg", kRadian_deg * (f.first.turn_rad + f.common.turn_rad)},
                    {"turn_sigma_deg", kRadian_deg * f.common.turn_sigma_rad},
                    {"slice_drift_um", rms_drift_um(f.common)},
                    {"slice_drift_ratio", f.common.slice_drift_ratio},
                    {"has_slice_drift", f.common.has_slice_drift},
                    {"share_at_rest", f.common.share_at_rest},
                    {"light_ratio", f.light_ratio},
                    {"bead_size_ratio", widths.across},
                    {"bead_size_ratio_z", widths.along},
                    {"bead_sigma_um", scale.pixel_um * relaxed.detection.widths_in_the_middle().xy},
                    {"bead_sigma_z_um", scale.step_um * relaxed.detection.widths_in_the_middle().z},
                    {"bead_distance_um", f.spacing_um},
                    {"pixel_size_um", scale.pixel_um},
                    {"focus_step_um", scale.step_um}};
  report.findings =
      findings_of(f, widths, std::max(relaxed.detection.share_saturated, stressed.detection.share_saturated));
  return report;
}

}  // namespace

void declare(stage::ParameterList& list, TrackStageParameters& p) {
  declare(list, p.track);
  list.table("track");
  list.add("binning", p.binning, Range::between(1, images::kLargestBinning));
  declare(list, p.in_space);
  declare(list, p.surface_plane, "surface");
  declare(list, p.effects, {"drift_affine", "effect_tolerance"});
}

beads::TrackParameters switched(const TrackStageParameters& given) {
  beads::TrackParameters parameters = given.track;
  parameters.drift_affine = given.effects.drift_affine;
  parameters.effect_tolerance = given.effects.effect_tolerance;
  if (parameters.beads_pixel_size_um) parameters.pixel_size_um = parameters.beads_pixel_size_um;
  return parameters;
}

bool are_in_space(const TrackStageParameters& given) {
  const auto is_whole = [](const images::PlaneChoice& c) { return c.z == images::kProjection && !c.page; };
  const bool are_whole = is_whole(given.track.relaxed_plane) && is_whole(given.track.stressed_plane);
  if (given.in_space.dimensions == Dimensions::plane) return false;
  if (given.in_space.dimensions == Dimensions::space) {
    if (are_whole) return true;
    throw UsageError("track.dimensions = space takes all slices: leave relaxed_z, stressed_z and the pages unset");
  }
  return are_whole && given.in_space.z_points.has_value();
}

StackLook look_at_stacks(const fs::path& relaxed, const fs::path& stressed, const TrackStageParameters& given,
                         int threads) {
  const beads::TrackParameters& track = given.track;
  const StackParameters& parameters = given.in_space;
  require_direction(parameters);
  std::vector<images::Image> slices = images::read_slices(relaxed, track.relaxed_plane);
  const Frame first = frame_of(relaxed.filename().string(), slices);
  require_slices(first);
  const Frame other = frame_of(stressed.filename().string(), images::read_slices(stressed, track.stressed_plane));
  require_same_size(first, other);
  const Scale scale = scale_of(first, other, track, parameters);
  const Detection detection = beads::with_names(
      first.name, kRemedy, [&] { return detect(std::move(slices), track.detection_snr, "relaxed", threads); });
  const double volume_um3 = scale.pixel_um * first.width * scale.pixel_um * first.height * scale.step_um * first.depth;
  const auto n = static_cast<double>(std::max<std::size_t>(1, detection.spots.size()));
  return {.width = first.width,
          .height = first.height,
          .depth = first.depth,
          .pixel_um = scale.pixel_um,
          .step_um = scale.step_um,
          .n_beads = static_cast<int>(detection.spots.size()),
          .distance_um = std::cbrt(volume_um3 / n)};
}

StageReport run(const TrackStageParameters& given, stage::StageContext& context) {
  const beads::TrackParameters track = switched(given);
  const StackParameters& parameters = given.in_space;
  const auto tell = [&](double fraction, const char* what) {
    if (context.progress) context.progress(fraction, what);
  };
  const fs::path relaxed_file = context.input("relaxed"), stressed_file = context.input("stressed");
  if (track.stressed_last > 0) throw UsageError("stressed_last is for images in the plane: track stacks one by one");
  require_direction(parameters);
  tell(0, "finding beads of the relaxed stack");
  const Read relaxed = beads::with_names(relaxed_file.string(), kRemedy, [&] {
    return read_and_detect(relaxed_file, track.relaxed_plane, "relaxed", track.detection_snr, nullptr, context);
  });
  // what is missing is reported before the longer half of the work
  scale_of(relaxed.frame, relaxed.frame, track, parameters);
  tell(0.4, "finding beads of the stressed stack");
  const Read stressed = beads::with_names(stressed_file.string(), kRemedy, [&] {
    return read_and_detect(stressed_file, track.stressed_plane, "stressed", track.detection_snr, &relaxed.frame,
                           context);
  });
  const Scale scale = scale_of(relaxed.frame, stressed.frame, track, parameters);
  for (const Frame* frame : {&relaxed.frame, &stressed.frame}) {
    if (track.pixel_size_um && frame->pixel_um)
      context.doubt(stage::doubt_about_pixel_size(*track.pixel_size_um, *frame->pixel_um),
                    frame->name + ": pixel_size_um");
  }
  if (std::ranges::equal(relaxed.detection.spots, stressed.detection.spots, {}, &Spot::place, &Spot::place)) {
    throw InputError(relaxed_file.string() + ", " + stressed_file.string(), "two stacks",
                     "the same beads to the last bit in both", "is one of them given twice?");
  }
  tell(0.8, "following beads");
  const Followed followed = beads::with_names(relaxed_file.string() + ", " + stressed_file.string(), kRemedy, [&] {
    return follow(
        placed(relaxed.detection, scale), placed(stressed.detection, scale),
        {.largest_displacement_um = track.largest_displacement_um, .outlier_threshold = track.outlier_threshold},
        parameters.slice_drift, scale.slices(), context.threads);
  });
  files::write_displacement_in_space(context.output("out", "displacement_3d.csv"), followed.field);
  beads::write_vtp(context, followed.field, "displacement_3d");
  write_slices(context, followed.common);
  StageReport report = report_of(followed, scale, relaxed, stressed);
  if (context.has_input("surface_beads")) {
    const fs::path file = context.input("surface_beads");
    const Read surface = beads::with_names(file.string(), kRemedy, [&] {
      return read_and_detect(file, given.surface_plane, "surface", track.detection_snr, &relaxed.frame, context);
    });
    write_surface_beads(context, placed(surface.detection, scale));
    report.figures.emplace_back("n_surface_beads", static_cast<std::int64_t>(surface.detection.spots.size()));
  }
  return report;
}

}  // namespace mbtfm::stacks
