#include "segment/beads/report.h"

#include <cmath>

#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/with_error.h"
#include "pipeline/files/csv_files.h"
#include "segment/beads/given_field.h"

namespace mbtfm::beads {

std::optional<Finding> noticed_stillness(const FieldFigures& f) {
  const auto n_good = static_cast<double>(std::max<std::int64_t>(1, f.n_good));
  return noticed(Symptom::nothing_moves, 1 - static_cast<double>(f.n_surely_moving) / n_good,
                 {.value = std::to_string(f.n_surely_moving) + " of " + std::to_string(f.n_good)});
}

void write_field(stage::StageContext& context, const DisplacementField& field, const std::string& name) {
  files::write_displacement(context.output("out", name + ".csv"), field);
  write_vtp(context, field, name);
}

std::string remedy_of(const InvalidData& error, const char* otherwise) {
  if (dynamic_cast<const ExchangedImages*>(&error))
    return "exchange the files of --stressed and --relaxed; if the cell does push outward, set track.may_push = true";
  const auto* lost = dynamic_cast<const NotFollowed*>(&error);
  if (!lost || !lost->remedy) return otherwise;
  return lost->remedy->empty()
             ? "do both show the beads of one place, in focus? Check the planes; neither windows (track.method), "
               "track.largest_displacement_um, track.detection_snr nor effects.drift_affine made them fit"
             : "tried out, this helps: " + *lost->remedy;
}

namespace {

/// Figures, findings and the last line that any field has, tracked or given.
StageReport report_of(const DisplacementField& field, stage::StageContext& context) {
  const FieldFigures figures = figures_of(field);
  const auto n_flagged = static_cast<std::int64_t>(field.size()) - figures.n_good;
  double squares = 0;
  for (const Bead& bead : field)
    if (bead.flag.empty()) squares += bead.sigma_um * bead.sigma_um;
  const auto n_good = static_cast<double>(std::max<std::int64_t>(1, figures.n_good));
  StageReport report;
  report.figures = {{"n_beads", static_cast<std::int64_t>(field.size())},
                    {"n_tracked", figures.n_good},
                    {"n_moving", figures.n_moving},
                    {"largest_displacement_um", figures.largest_um},
                    {"sigma_um", std::sqrt(squares / n_good)},
                    {"outwardness", outwardness(field)}};
  if (n_flagged > 0) report.summary += "; " + std::to_string(n_flagged) + " flagged in displacement.csv";
  context.notice(noticed_stillness(figures));
  context.notice(noticed(Symptom::moves_outward, outwardness(field)));
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
void notice_images(const Tracking& tracking, stage::StageContext& context) {
  const auto by_correlation = [&](const std::string& why) {
    context.notice(noticed(Symptom::tracked_by_correlation, 1, {.value = brief(tracking.window_um), .at = why}));
  };
  if (tracking.windows.is_on && tracking.windows.setting == Switch::automatic)
    by_correlation("as " + tracking.windows.why);
  if (tracking.n_windows > 0)
    by_correlation("where single beads cannot be: " + brief(100 * tracking.share_of_gaps) + " % of the image");
  const BeadSizes& sizes = tracking.sizes;
  const double ratio = sizes.ratio, larger = std::max(ratio, 1 / ratio);
  constexpr double kCertain = 3;  // standard errors
  if (std::abs(ratio - 1) > kCertain * sizes.sigma)
    context.notice(
        noticed(Symptom::defocused, larger,
                {.value = with_error(larger, sizes.sigma * larger / ratio), .at = ratio > 1 ? "stressed" : "relaxed"}));
  if (sizes.elongation - 1 > kCertain * sizes.elongation_sigma) {
    const double angle_deg = kRadian_deg * sizes.angle_rad;
    context.notice(noticed(
        Symptom::beads_not_round, sizes.elongation,
        {.value = with_error(sizes.elongation, sizes.elongation_sigma),
         .at = brief(std::round(angle_deg < 0 ? angle_deg + 180 : angle_deg)) + " degrees (0: rows, 90: columns)" +
               (sizes.is_of_pixels ? ", by pixels that are not square" : ""),
         .severity = sizes.is_of_pixels ? Severity::caution : Severity::note}));
  }
  if (const Ghosts& g = tracking.ghosts; g.share > 5 * g.sigma)
    context.notice(noticed(Symptom::ghost_beads, g.share, {.at = g.is_relaxed ? "relaxed" : "stressed"}));
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

}  // namespace

StageReport report_of(const TrackedFrame& frame, CellWith cell_with, stage::StageContext& context) {
  const Tracking& tracking = frame.tracking;
  const double pixel_size_um = frame.pixel_size_um;
  StageReport report = report_of(tracking.field, context);
  const bool has_windows = tracking.windows.is_on;
  const Vec2 shift_um = frame.stage_shift_um();
  report.summary = std::to_string(tracking.n_good) + " of " + std::to_string(tracking.field.size()) +
                   (has_windows ? " windows tracked" : " beads tracked") + report.summary;
  if (norm(shift_um) > pixel_size_um) {
    report.summary += "; the stage moved by " + brief(norm(shift_um)) + " um, places are those of the " +
                      (cell_with == CellWith::relaxed ? "relaxed" : "stressed") + " image";
  }
  notice_images(tracking, context);
  context.notice(noticed(Symptom::beads_wide, diameter_in_focus_um(tracking.bead_sigma_um, pixel_size_um)));
  if (tracking.period_um > 0) {
    const double farthest_um = std::max(norm(shift_um), figures_of(tracking.field).largest_um);
    context.notice(noticed(Symptom::pattern_repeats, farthest_um / tracking.period_um));
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
                        {"bead_elongation_sigma", tracking.sizes.elongation_sigma},
                        {"ghost_share", tracking.ghosts.share},
                        {"ghost_share_sigma", tracking.ghosts.sigma}};
  report.figures.insert(report.figures.end(), more.begin(), more.end());
  add_figures(report, tracking.common);
  report.effects = {tracking.affine, tracking.windows};
  return report;
}

StageReport run_given(const TrackParameters& parameters, stage::StageContext& context) {
  std::optional<images::ImageField> picture;
  if (context.has_input("cell_image")) picture = images::read_field(context.input("cell_image"));
  GivenField table = read_given_field(context.input("displacement"), parameters, picture);
  DisplacementField& field = table.field;
  context.expect_plausible("beads_per_um2", beads_per_um2(field));
  const GivenMotion motion = take_motion_off(field, parameters);
  write_field(context, field, "displacement");
  StageReport report = report_of(field, context);
  add_figures(report, motion.common);
  report.effects = {motion.affine};
  report.figures.emplace_back("table", std::string(name_of(table.form)));
  report.findings = std::move(table.findings);
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

}  // namespace mbtfm::beads
