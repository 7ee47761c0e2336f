#include "segment/beads/track.h"

#include <algorithm>
#include <cmath>
#include <exception>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/stopwatch.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/stage/effects.h"
#include "pipeline/stage/parameters.h"
#include "segment/beads/coarse_field.h"
#include "segment/beads/common_motion.h"
#include "segment/beads/follow.h"
#include "segment/beads/given_field.h"
#include "segment/beads/measure.h"
#include "segment/beads/scene.h"
#include "segment/beads/windows.h"

namespace mbtfm::beads {
namespace {

/// @param least_px  that makes the right peak stand out: sixteen beads
int search_window(double least_px, const TrackParameters& parameters, double pixel_size_um) {
  double needed = std::max(64.0, least_px);
  // shifts are found up to half a window
  if (parameters.largest_displacement_um > 0) {
    needed = std::max(needed, 2.2 * parameters.largest_displacement_um / pixel_size_um);
  }
  int window = 32;
  while (window < needed) window *= 2;
  return window;
}

void require_numbers(const images::Image& image, const char* which) {
  for (int j = 0; j < image.height; ++j) {
    for (int i = 0; i < image.width; ++i) {
      if (std::isfinite(image.at(i, j))) continue;
      throw InvalidData(std::string("the ") + which + " image", "a number in every pixel",
                        "none at column " + std::to_string(i + 1) + ", row " + std::to_string(j + 1));
    }
  }
}

/// The motion of each place, px: of a bead, or of a window.
struct Measured {
  std::shared_ptr<const Scene> scene;
  std::vector<Track> tracks;
  Pooling pooling;
  BeadSizes sizes = {};
  double window_px = 0;  ///< Gaussian sigma of the windows; 0: beads
  double period_px = 0;  ///< of a pattern that repeats itself; 0: it does not
};

/// What moved the good beads together, px. @param motion_of  by bead. @param setting  as of drift_affine
template <class MotionOf>
MotionTaken motion_of_all(const Scene& scene, const std::vector<Track>& tracks, const MotionOf& motion_of,
                          Switch setting, double tolerance) {
  std::vector<Vec2> positions, displacements;
  for (int k = 0; k < scene.n_beads(); ++k) {
    if (!tracks[k].is_good()) continue;
    positions.push_back(scene.position(k));
    displacements.push_back(motion_of(k));
  }
  const Plane& plane = scene.relaxed->image.plane;
  return motion_taken(positions, displacements, {-0.5, -0.5}, plane.width, plane.height, setting, tolerance, 1);
}

/// A turn that is taken for displacement is a wrong field, however well its beads were found.
void require_shift_alone(const MotionTaken& all) {
  if (all.affine.is_on || !all.is_large) return;
  throw InvalidData("the stressed image", "one that is shifted at most (effects.drift_affine = off)",
                    affine_in_words(all.common));
}

/// The beads that left the stressed image when it was turned.
void flag_turned_out(const Scene& scene, const Turn& turn, std::vector<Track>& tracks) {
  const Plane& plane = scene.stressed.image.plane;
  const double margin = 2 * scene.bead_sigma();
  for (int k = 0; k < scene.n_beads(); ++k) {
    const Vec2 there = turn.of(scene.position(k) + tracks[k].found.motion.u);
    const double inside = std::min({there.x, there.y, plane.width - 1 - there.x, plane.height - 1 - there.y});
    if (inside < margin) tracks[k].flag = TrackFlag::edge;
  }
}

/// The beads that the stressed image would not show at rest: what is found in their place, others are.
void flag_out_of_sight(const Scene& scene, const Placement& stressed, std::vector<Track>& tracks) {
  const Plane& plane = scene.stressed.image.plane;
  for (int k = 0; k < scene.n_beads(); ++k) {
    const Vec2 at_rest = stressed.of(scene.position(k));
    const bool is_inside = at_rest.x >= 0 && at_rest.y >= 0 && at_rest.x < plane.width && at_rest.y < plane.height;
    if (!is_inside && tracks[k].is_good()) tracks[k].flag = TrackFlag::edge;
  }
}

/// What the good tracks go on to everywhere.
GridField field_of(const Scene& scene, const std::vector<Track>& tracks) {
  std::vector<Vec2> places;
  std::vector<Motion> motions;
  for (int k = 0; k < scene.n_beads(); ++k) {
    if (!tracks[k].is_good()) continue;
    places.push_back(scene.position(k));
    motions.push_back(tracks[k].found.motion);
  }
  return field_through(places, motions, grid_over(scene.relaxed->image.plane, scene.spacing()), scene.threads);
}

/// From the grid. If it finds none of the beads in parts of the picture, as where they moved further than it searches,
/// or by too different distances, from one that searches further; then, again and again, from what the beads found so
/// far predict, as long as that finds more. Those bear out each other: what the images' grids find counts as found by
/// the grid.
Followed followed_from_grid(const Scene& scene, const TrackParameters& parameters, int window) {
  const Plane &from = scene.relaxed->image.plane, &to = scene.stressed.image.plane;
  Followed best = follow(scene, coarse_field(from, to, window, scene.threads), parameters, Led::together);
  if (!best.has_gaps || best.period_px > 0) return best;  // of a pattern that repeats itself the least shift counts
  Followed far = follow(scene, coarse_to_fine_field(from, to, window, scene.threads), parameters, Led::by_each);
  if (far.n_by_grid <= best.n_by_grid) return best;
  best = std::move(far);
  const int n_by_grid = best.n_by_grid;
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    Followed next = follow(scene, field_of(scene, best.tracks), parameters, Led::by_each);
    if (next.n_by_grid <= best.n_by_grid) break;
    best = std::move(next);
  }
  best.n_by_grid = n_by_grid;
  return best;
}

/// Found from the grid with the wide window, measured in the narrow one, even where beads are loose or not resolved and
/// single ones scatter: a wider window would hide the scatter and flatten the peaks.
Followed followed_and_measured(const Scene& scene, const std::optional<Turn>& turn, const TrackParameters& parameters,
                               int window, const Gaps* gaps = nullptr) {
  Followed followed = followed_from_grid(scene, parameters, window);
  // beside windows that are far more alike those in gaps would seem to show something else
  for (int k = 0; gaps && k < scene.n_beads(); ++k) {
    if (!gaps->hold(scene.position(k))) followed.tracks[k].flag = TrackFlag::no_partner;
  }
  measure(scene, parameters.least_similarity, followed.tracks);
  verify(scene, followed.tracks);
  if (turn) flag_turned_out(scene, *turn, followed.tracks);
  flag_outliers(scene, parameters.outlier_threshold, followed.tracks);
  return followed;
}

/// Where a pixel lies, um: positions count from the centre of the first pixel.
Vec2 place_um(Vec2 position_px, double pixel_size_um) { return pixel_size_um * (position_px + Vec2{0.5, 0.5}); }

/// The relaxed picture in the cell's ones. @param own  the same in this stressed picture
Placement placement_of_cell(const TrackParameters& parameters, const std::optional<Placement>& cell,
                            const Placement& own) {
  switch (parameters.cell_with) {
    case CellWith::relaxed:
      return {};
    case CellWith::stressed:
      return cell.value_or(own);
    case CellWith::each:
      return own;
  }
  return own;
}

/// Of the model of the gel, which is in the frame of the cell's pictures.
struct PlacedModel {
  const FieldModel& um;
  const std::optional<Placement>& cell;  ///< if it is known before the beads are followed
};

/// Once more, each bead compared with its neighbours in what they do beside the model.
void follow_beside(const PlacedModel& model, const Scene& scene, const std::optional<Turn>& turn,
                   const TrackParameters& parameters, double pixel_size_um, std::vector<Track>& tracks) {
  Placement own{.turn = turn};
  const bool needs_own =
      parameters.cell_with != CellWith::relaxed && !(model.cell && parameters.cell_with == CellWith::stressed);
  if (needs_own) {
    own.motion = motion_of_all(
                     scene, tracks, [&](int k) { return tracks[k].found.motion.u; }, parameters.drift_affine,
                     parameters.effect_tolerance)
                     .motion;
  }
  const Placement cell = placement_of_cell(parameters, model.cell, own);
  const double angle_rad = cell.turn_rad() - own.motion.turn_rad;  // from the picture turned back
  DisplacementField beads;
  for (int k = 0; k < scene.n_beads(); ++k) {
    beads.push_back({.position_um = place_um(cell.of(scene.position(k)), pixel_size_um),
                     .displacement_um = pixel_size_um * rotated(tracks[k].found.motion.u, angle_rad),
                     .sigma_um = 0,
                     .flag = name_of(tracks[k].flag)});
  }
  std::vector<Vec2> expected = model.um(beads);
  if (expected.empty()) return;
  for (Vec2& u : expected) u = 1 / pixel_size_um * rotated(u, -angle_rad);
  flag_outliers_beside(expected, scene, parameters.outlier_threshold, tracks);
  recover(scene, parameters.least_similarity, tracks, expected);
}

/// The same beads at the width of another image that is out of focus. The noise stays that of this one's pixels.
void widen(Side& side, const images::Image& image, double own_px, double wide_px, int threads) {
  Plane plane = without_background(image, background_sigma(wide_px));
  if (own_px < wide_px) {
    plane = blurred(plane, std::sqrt(wide_px * wide_px - own_px * own_px));
    for (DetectedBead& bead : side.beads) bead.brightness *= std::pow(own_px / wide_px, 2);
  }
  side.image = smooth_image(std::move(plane), threads);
  side.bead_sigma = wide_px;
}

/// A window of sharp beads does not fit on wide ones. If one image is wider by the factor that `defocused` names, the
/// sharp one is compared at the width of the other: no narrower window sees more than that one shows.
std::shared_ptr<const Scene> alike_wide(const std::shared_ptr<const Scene>& scene, const images::Image& relaxed,
                                        const images::Image& stressed) {
  constexpr double kOutOfFocus = 1.5;
  const double here = bead_sigma_of(scene->relaxed->image.plane), there = bead_sigma_of(scene->stressed.image.plane);
  const double wide = std::max(here, there);
  if (!(here > 0 && there > 0) || wide < kOutOfFocus * std::min(here, there)) return scene;
  Side first = *scene->relaxed, second = scene->stressed;
  widen(first, relaxed, here, wide, scene->threads);
  widen(second, stressed, there, wide, scene->threads);
  return std::make_shared<const Scene>(
      scene_of(std::make_shared<const Side>(std::move(first)), std::move(second), scene->threads));
}

Measured measured_beads(const std::shared_ptr<const Side>& relaxed, const images::Image& image,
                        const images::Image& stressed, const std::optional<Turn>& turn,
                        const TrackParameters& parameters, double pixel_size_um, int threads,
                        const PlacedModel& model) {
  const auto sharp = std::make_shared<const Scene>(scene_of(
      relaxed, side_of(stressed, relaxed->bead_sigma, parameters.detection_snr, "stressed", threads), threads));
  const auto scene = alike_wide(sharp, image, stressed);
  auto [tracks, n_by_grid, period_px, has_gaps] =
      followed_and_measured(*scene, turn, parameters, search_window(4 * scene->spacing(), parameters, pixel_size_um));
  recover(*scene, parameters.least_similarity, tracks);
  constexpr int kRounds = 2;  // what the first one mends makes the model better
  for (int round = 0; model.um && round < kRounds; ++round) {
    follow_beside(model, *scene, turn, parameters, pixel_size_um, tracks);
  }
  Pooling pooling = pooled(*scene, parameters.outlier_threshold, tracks);  // flags matches, too, made without a window
  if (turn) flag_turned_out(*scene, *turn, tracks);                        // those found again
  require_common_beads(n_by_grid, n_good(tracks), scene->n_beads());
  const BeadSizes sizes = sizes_of(*sharp, tracks);
  return {.scene = scene,
          .tracks = std::move(tracks),
          .pooling = std::move(pooling),
          .sizes = sizes,
          .period_px = period_px};
}

/// What a size of window gives.
struct Tried {
  Measured measured;
  int n_by_grid = 0;
  bool is_sound = false;  ///< two windows in three are found again, and their errors are known
  double median_sigma_px = 0;
  double knowledge = 0;  ///< sum of 1/sigma²
};

/// @param gaps  whose windows alone count; none: all do
/// @param spacing_px  of the windows; 0: as far as they do not overlap
Tried tried_windows(const Texture& relaxed, const Texture& stressed, double window_px, const std::optional<Turn>& turn,
                    TrackParameters parameters, double pixel_size_um, int threads, const Gaps* gaps,
                    double spacing_px = 0) {
  const Windows windows = windows_on(relaxed, stressed, window_px, threads, spacing_px);
  const auto scene = std::make_shared<const Scene>(windows.scene);
  parameters.least_similarity = least_similarity(relaxed, window_px);
  // a square of seven Gaussian sigmas is halved on the finer grid, and holds as much as the Gaussian then
  auto [tracks, n_by_grid, period_px, has_gaps] =
      followed_and_measured(*scene, turn, parameters, search_window(7 * window_px, parameters, pixel_size_um), gaps);
  Tried result{.measured = {scene, std::move(tracks), {}, {}, window_px, period_px}, .n_by_grid = n_by_grid};
  auto pooling = calibrated(windows, result.measured.tracks);
  if (!pooling) return result;
  std::vector<double> sigmas;
  std::size_t n_counted = 0;
  for (int k = 0; k < scene->n_beads(); ++k) {
    if (gaps && !gaps->hold(scene->position(k))) continue;
    ++n_counted;
    if (!result.measured.tracks[k].is_good()) continue;
    const double sigma_px = pooling->beads[k].sigma_px;
    sigmas.push_back(sigma_px);
    result.knowledge += 1 / (sigma_px * sigma_px);
  }
  result.is_sound = !sigmas.empty() && 3 * sigmas.size() >= 2 * n_counted;
  result.median_sigma_px = numerics::quantile(std::move(sigmas), 0.5);
  result.measured.pooling = std::move(*pooling);
  return result;
}

/// In the smallest windows that are fine enough; where none are, in those that know most together.
Measured measured_windows(const Texture& relaxed, const images::Image& stressed, const std::optional<Turn>& turn,
                          const TrackParameters& parameters, double pixel_size_um, int threads,
                          const Gaps* gaps = nullptr) {
  const Texture moved = texture_of(stressed, relaxed.spot_sigma_px, "stressed");
  std::optional<Tried> best;
  int n_by_grid = 0, n_found = 0, n_tried = 0;
  for (const double window_px : window_sigmas(relaxed)) {
    Tried tried = tried_windows(relaxed, moved, window_px, turn, parameters, pixel_size_um, threads, gaps);
    constexpr double kFineEnough = 0.1;  // px: a tenth of what moves in a picture worth tracking
    const bool is_fine = tried.is_sound && tried.median_sigma_px <= kFineEnough;
    n_by_grid = tried.n_by_grid, n_found = n_good(tried.measured.tracks), n_tried = tried.measured.scene->n_beads();
    if (tried.is_sound && (is_fine || !best || tried.knowledge > best->knowledge)) best = std::move(tried);
    if (is_fine) break;
  }
  if (!best) {
    throw NotFollowed(
        "the stressed image", "the relaxed image's texture, displaced",
        std::to_string(std::min(n_by_grid, n_found)) + " of " + std::to_string(n_tried) + " windows of it");
  }
  return std::move(best->measured);
}

CommonMotion in_um(CommonMotion common, double pixel_size_um) {
  common.drift_um = pixel_size_um * common.drift_um;
  common.drift_sigma_um *= pixel_size_um;
  return common;
}

/// With the turn by which the image was turned back before.
CommonMotion turned_as_before(CommonMotion common, const Turn& turn, Vec2 centre) {
  common.drift_um = turn.of(centre + common.drift_um) - centre;
  common.turn_rad += turn.angle_rad;
  return common;
}

/// At rest in the cell's frame, the motion of all taken off. @param own  the relaxed picture in the stressed one
Bead entry_of(const Measured& measured, int k, const Placement& own, const Placement& cell, double pixel_size_um) {
  const Pooled& found = measured.pooling.beads[k];
  const Vec2 place = measured.scene->position(k);
  const double angle_rad = cell.turn_rad() - own.motion.turn_rad;
  return {.position_um = place_um(cell.of(place), pixel_size_um),
          .displacement_um = pixel_size_um * rotated(found.u - own.motion.at(place), angle_rad),
          .sigma_um = pixel_size_um * found.sigma_px,
          .flag = name_of(measured.tracks[k].flag)};
}

Tracking tracking_of(const Measured& measured, const MotionTaken& all, const Placement& own, const Placement& cell,
                     double pixel_size_um) {
  const Scene& scene = *measured.scene;
  const std::vector<Track>& tracks = measured.tracks;
  const Pooling& pooling = measured.pooling;
  Tracking result;
  result.far_field_rms_um = pixel_size_um * all.rms;
  result.noise_um = pixel_size_um * all.noise;
  result.scatter_um = pixel_size_um * pooling.scatter_px;
  result.bead_sigma_um = pixel_size_um * scene.bead_sigma();
  result.n_beads_stressed = static_cast<int>(scene.stressed.beads.size());
  result.window_um = pixel_size_um * measured.window_px;
  result.period_um = pixel_size_um * measured.period_px;
  result.sizes = measured.sizes;
  result.affine = all.affine;
  result.stressed = own;
  for (int k = 0; k < scene.n_beads(); ++k) {
    result.field.push_back(entry_of(measured, k, own, cell, pixel_size_um));
    if (tracks[k].is_good()) ++result.n_good;
  }
  return result;
}

/// Whether a change made the images fit together, and not a few beads by chance: two in three are followed, as is asked
/// where the grid bears out nothing, and of a hundred that were compared with their neighbours ten contradict at most.
/// (Strangers agree with one in twenty of their neighbours.)
bool is_sound(const Tracking& tracking) {
  const auto n = static_cast<int>(tracking.field.size());
  const auto n_against = static_cast<int>(
      std::ranges::count(tracking.field, std::string(name_of(TrackFlag::neighbours_disagree)), &Bead::flag));
  return 3 * tracking.n_good >= 2 * n && 9 * n_against <= tracking.n_good;
}

}  // namespace

void declare(stage::ParameterList& list, TrackParameters& p) {
  list.table("");
  list.add("pixel_size_um", p.pixel_size_um, Range::pixel_um());
  list.table_of_several("images");
  list.add("cell_with", p.cell_with);
  list.table("track");
  declare(list, p.stressed_plane, "stressed");
  declare(list, p.relaxed_plane, "relaxed");
  list.add("beads_pixel_size_um", p.beads_pixel_size_um, Range::pixel_um());
  list.add("stressed_last", p.stressed_last, {.low = 0});
  list.add("method", p.method);
  list.add("detection_snr", p.detection_snr, Range::factor());
  list.add("largest_displacement_um", p.largest_displacement_um, Range::between(0, 100));
  list.add("may_push", p.may_push);
  list.add("least_similarity", p.least_similarity, Range::between(0, 1));
  list.add("windows_spacing_um", p.windows_spacing_um, Range::between(0, 1000));
  list.add("outlier_threshold", p.outlier_threshold, Range::factor());
  list.add("table", p.table);
  list.add("x_column", p.x_column);
  list.add("y_column", p.y_column);
  list.add("ux_column", p.ux_column);
  list.add("uy_column", p.uy_column);
  list.add("sigma_column", p.sigma_column);
  list.add("length_unit", p.length_unit);
  list.add("y_axis", p.y_axis);
  list.add("seconds_between", p.seconds_between, Range::positive());
  list.add("places", p.places);
}

RelaxedBeads::RelaxedBeads(const images::Image& relaxed, const TrackParameters& parameters, int threads,
                           FieldModel model)
    : relaxed_(relaxed), parameters_(parameters), threads_(threads), model_(std::move(model)) {
  require_numbers(relaxed, "relaxed");
  const TrackMethod method = parameters.method;
  const double rough_background = 12;  // px: six sigmas of an ordinary bead; set from the bead itself afterwards
  const double bead_sigma = bead_sigma_of(without_background(relaxed, rough_background));
  if (method != TrackMethod::correlation) {
    Side side = side_of(relaxed, bead_sigma, parameters.detection_snr, "relaxed", threads);
    side.around = beads_around(side, threads);
    side_ = std::make_shared<const Side>(std::move(side));
  }
  if (method != TrackMethod::beads || parameters.windows_spacing_um > 0) {
    texture_ = std::make_shared<const Texture>(texture_of(relaxed, bead_sigma, "relaxed"));
  }
}

Tracking RelaxedBeads::track(const images::Image& image, double pixel_size_um, const Progress& progress,
                             const std::optional<Placement>& cell) const {
  const Stressed stressed{image, pixel_size_um, cell, progress};
  const auto size = [](const images::Image& of) {
    return std::to_string(of.width) + " x " + std::to_string(of.height);
  };
  if (size(relaxed_) != size(image)) {
    throw InvalidData("the stressed image", "the relaxed image's " + size(relaxed_) + " pixels", size(image));
  }
  require_numbers(image, "stressed");
  try {
    return track_by_any(stressed);
  } catch (NotFollowed& error) {
    error.hint = remedy(stressed);
    throw;
  }
}

/// Single beads first: where they can be followed, each knows more of its place than a window does.
Tracking RelaxedBeads::track_by_any(const Stressed& stressed) const {
  const auto by = [&](TrackMethod method) { return track_by(method, stressed); };
  const TrackMethod method = parameters_.method;
  if (method != TrackMethod::automatic) {
    Tracking result = by(method);
    const bool is_on = method == TrackMethod::correlation;
    result.windows = stage::decided(EffectKind::correlation_windows, switched(is_on), is_on, "as asked");
    return result;
  }
  try {
    Tracking result = by(TrackMethod::beads);
    result.windows =
        stage::decided(EffectKind::correlation_windows, Switch::automatic, false, "single beads can be followed");
    return result;
  } catch (const NotFollowed& beads) {
    const Stopwatch watch;
    std::optional<Tracking> result;
    try {
      result = by(TrackMethod::correlation);
    } catch (const NotFollowed&) {
      throw beads;
    }
    result->windows = stage::decided(EffectKind::correlation_windows, Switch::automatic, true,
                                     "single beads cannot be followed: of " + beads.element + " " + beads.expected +
                                         " were expected, " + beads.found + " found");
    result->windows.seconds = watch.seconds();
    return *result;
  }
}

Tracking RelaxedBeads::track_by(TrackMethod method, const Stressed& stressed) const {
  const auto as = [&](Switch setting) { return track_as(method, setting, stressed); };
  if (parameters_.drift_affine != Switch::automatic) return as(parameters_.drift_affine);
  std::optional<Tracking> unturned;
  std::exception_ptr refused;
  try {
    unturned = as(Switch::automatic);
  } catch (const ExchangedImages&) {
    throw;
  } catch (const InvalidData&) {  // turned so far that its beads are not met with again?
    refused = std::current_exception();
  }
  // A turn is its angle and nothing else while it is small: 0.01 shortens lengths by 5e-5.
  constexpr double kSmall_rad = 0.01;
  if (unturned && !(unturned->affine.is_on && std::abs(unturned->common.turn_rad) > kSmall_rad)) return *unturned;
  try {
    Tracking turned = as(Switch::on);
    turned.affine = stage::decided(
        turned.affine.kind, Switch::automatic, true,
        "unturned, the images do not fit together; with " + affine_in_words(turned.common) + " taken off they do");
    return turned;
  } catch (const ExchangedImages&) {
    throw;
  } catch (const InvalidData&) {
    if (unturned) return *unturned;
    std::rethrow_exception(refused);
  }
}

Tracking RelaxedBeads::track_as(TrackMethod method, Switch setting, const Stressed& stressed) const {
  const double pixel_size_um = stressed.pixel_size_um;
  const auto tell = [&](double fraction, const char* what) {
    if (stressed.progress) stressed.progress(fraction, what);
  };
  const bool by_beads = method == TrackMethod::beads;
  const Plane& plane = by_beads ? side_->image.plane : texture_->plane;
  const double spot_sigma = by_beads ? side_->bead_sigma : texture_->spot_sigma_px;
  std::optional<Turn> turn;
  if (setting == Switch::on) {
    tell(0, "turning the image back");
    const Plane light = by_beads ? without_background(stressed.image, background_sigma(spot_sigma))
                                 : texture_of(stressed.image, spot_sigma, "stressed").plane;
    turn = turn_between(plane, light, spot_sigma, threads_);
    if (!turn && by_beads) require_common_beads(0, 0, static_cast<int>(side_->beads.size()));
    if (!turn)
      throw NotFollowed("the stressed image", "the relaxed image's texture, turned", "no turn that stands out");
  }
  const images::Image unturned = turn ? turned_back(stressed.image, *turn, threads_) : stressed.image;
  tell(0, by_beads ? "following beads" : "following windows");
  Measured measured = by_beads ? measured_beads(side_, relaxed_, unturned, turn, parameters_, pixel_size_um, threads_,
                                                {model_, stressed.cell})
                               : measured_windows(*texture_, unturned, turn, parameters_, pixel_size_um, threads_);
  const MotionTaken all = motion_of_all(
      *measured.scene, measured.tracks, [&](int k) { return measured.pooling.beads[k].u; }, setting,
      parameters_.effect_tolerance);
  require_shift_alone(all);
  const Placement own{all.motion, turn}, cell = placement_of_cell(parameters_, stressed.cell, own);
  flag_out_of_sight(*measured.scene, own, measured.tracks);
  Tracking result = tracking_of(measured, all, own, cell, pixel_size_um);
  if (by_beads && parameters_.method == TrackMethod::automatic && !parameters_.is_series) {
    const Gaps gaps(*measured.scene, measured.tracks);
    result.share_of_gaps = gaps.share();
    if (gaps.are_large()) {
      tell(0.9, "following windows where beads fail");
      fill(gaps, unturned, cell, pixel_size_um, result);
    }
  }
  if (parameters_.windows_spacing_um > 0) {
    tell(0.95, "following windows everywhere");
    result.lattice = lattice_of(unturned, own, cell, pixel_size_um);
  }
  const CommonMotion common = turn ? turned_as_before(all.common, *turn, all.motion.centre) : all.common;
  result.common = in_um(common, pixel_size_um);
  const bool is_affine_left = all.is_affine && !all.affine.is_on;
  if (!parameters_.may_push && points_outward(result.field, result.common, is_affine_left)) {
    throw ExchangedImages("the stressed image", "beads that a cell pulls inward",
                          "beads that move outward (" + brief(outwardness(result.field)) +
                              " of -1, inward, to 1), as if the stressed and the relaxed image were exchanged");
  }
  return result;
}

/// Windows in the gaps, beside the beads.
void RelaxedBeads::fill(const Gaps& gaps, const images::Image& unturned, const Placement& cell, double pixel_size_um,
                        Tracking& tracking) const {
  const Placement& own = tracking.stressed;
  std::optional<Measured> windows;
  try {
    windows = measured_windows(*texture_, unturned, own.turn, parameters_, pixel_size_um, threads_, &gaps);
  } catch (const NotFollowed&) {
    return;  // there is no texture either
  }
  tracking.window_um = pixel_size_um * windows->window_px;
  for (int k = 0; k < windows->scene->n_beads(); ++k) {
    const Pooled& found = windows->pooling.beads[k];
    if (!windows->tracks[k].is_good() || !gaps.allow(windows->scene->position(k), found.u, found.sigma_px)) continue;
    tracking.field.push_back(entry_of(*windows, k, own, cell, pixel_size_um));
    ++tracking.n_windows;
    ++tracking.n_good;
  }
}

/// Windows of the size that is fine enough, as closely as asked for. Empty where there is no texture to follow.
DisplacementField RelaxedBeads::lattice_of(const images::Image& unturned, const Placement& own, const Placement& cell,
                                           double pixel_size_um) const {
  try {
    const double window_px =
        measured_windows(*texture_, unturned, own.turn, parameters_, pixel_size_um, threads_).window_px;
    const Texture moved = texture_of(unturned, texture_->spot_sigma_px, "stressed");
    const Tried tried = tried_windows(*texture_, moved, window_px, own.turn, parameters_, pixel_size_um, threads_,
                                      nullptr, parameters_.windows_spacing_um / pixel_size_um);
    DisplacementField lattice;
    for (std::size_t k = 0; k < tried.measured.pooling.beads.size(); ++k)
      lattice.push_back(entry_of(tried.measured, static_cast<int>(k), own, cell, pixel_size_um));
    return lattice;
  } catch (const NotFollowed&) {
    return {};
  }
}

/// Tried out one by one, the whole tracking each: an error has the time, and a hint that does not help costs the reader
/// more.
std::string RelaxedBeads::remedy(const Stressed& stressed) const {
  const auto helps = [&](const auto& change) {
    TrackParameters changed = parameters_;
    change(changed);
    try {
      return is_sound(RelaxedBeads(relaxed_, changed, threads_, model_)
                          .track_by_any({stressed.image, stressed.pixel_size_um, stressed.cell, {}}));
    } catch (const InvalidData&) {
      return false;
    }
  };
  std::vector<std::string> found;
  if (parameters_.method != TrackMethod::automatic && helps([](auto& p) { p.method = TrackMethod::automatic; })) {
    found.push_back("track.method = auto");
  }
  if (parameters_.drift_affine == Switch::off && helps([](auto& p) { p.drift_affine = Switch::automatic; })) {
    found.push_back("effects.drift_affine = auto: one image is turned against the other");
  }
  const double further_um = 0.25 * std::min(relaxed_.width, relaxed_.height) * stressed.pixel_size_um;
  if (parameters_.largest_displacement_um < further_um &&
      helps([&](auto& p) { p.largest_displacement_um = further_um; })) {
    found.push_back("track.largest_displacement_um = " + brief(further_um) + ": what moved, moved far");
  }
  constexpr double kLow = 3;  // below 3 sd most of what is found is noise
  if (parameters_.detection_snr > kLow && helps([](auto& p) { p.detection_snr = kLow; })) {
    found.push_back("track.detection_snr = " + brief(kLow) + ": the beads are weak");
  }
  std::string text;
  for (const std::string& way : found) text += (text.empty() ? "" : "; or ") + way;
  return text;
}

Tracking track_beads(const images::Image& relaxed, const images::Image& stressed, double pixel_size_um,
                     const TrackParameters& parameters, const Work& work) {
  return RelaxedBeads(relaxed, parameters, work.threads).track(stressed, pixel_size_um, work.progress);
}

}  // namespace mbtfm::beads
