#include "segment/beads/measured.h"

#include <algorithm>
#include <cmath>

#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::beads {

MotionTaken motion_of_all(const Scene& scene, const std::vector<Track>& tracks, const std::vector<Vec2>& motions,
                          Switch setting, double tolerance) {
  std::vector<Vec2> positions, displacements;
  for (int k = 0; k < scene.n_beads(); ++k) {
    if (!tracks[k].is_good()) continue;
    positions.push_back(scene.position(k));
    displacements.push_back(motions[k]);
  }
  const Plane& plane = scene.relaxed->image.plane;
  return motion_taken(positions, displacements, {-0.5, -0.5}, plane.width, plane.height, setting, tolerance, 1);
}

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

namespace {

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
/// @param least_px  a window that makes the right peak stand out
Followed followed_and_measured(const Scene& scene, const Setting& as, double least_px, const Gaps* gaps = nullptr) {
  const TrackParameters& parameters = as.parameters;
  Followed followed = followed_from_grid(scene, parameters, search_window(least_px, parameters, as.pixel_size_um));
  // beside windows that are far more alike those in gaps would seem to show something else
  for (int k = 0; gaps && k < scene.n_beads(); ++k) {
    if (!gaps->hold(scene.position(k))) followed.tracks[k].flag = TrackFlag::no_partner;
  }
  measure(scene, parameters.least_similarity, followed.tracks);
  verify(scene, followed.tracks);
  if (as.turn) flag_turned_out(scene, *as.turn, followed.tracks);
  flag_outliers(scene, parameters.outlier_threshold, followed.tracks);
  return followed;
}

/// Once more, each bead compared with its neighbours in what they do beside the model.
void follow_beside(const PlacedModel& model, const Scene& scene, const Setting& as, std::vector<Track>& tracks) {
  const TrackParameters& parameters = as.parameters;
  Placement own{.turn = as.turn};
  const bool needs_own =
      parameters.cell_with != CellWith::relaxed && !(model.cell && parameters.cell_with == CellWith::stressed);
  if (needs_own) {
    std::vector<Vec2> motions;
    for (const Track& track : tracks) motions.push_back(track.found.motion.u);
    own.motion = motion_of_all(scene, tracks, motions, parameters.drift_affine, parameters.effect_tolerance).motion;
  }
  const Placement cell = placement_of_cell(parameters, model.cell, own);
  const double angle_rad = cell.turn_rad() - own.motion.turn_rad;  // from the picture turned back
  DisplacementField beads;
  for (int k = 0; k < scene.n_beads(); ++k) {
    beads.push_back({.position_um = place_um(cell.of(scene.position(k)), as.pixel_size_um),
                     .displacement_um = as.pixel_size_um * rotated(tracks[k].found.motion.u, angle_rad),
                     .sigma_um = 0,
                     .flag = name_of(tracks[k].flag)});
  }
  std::vector<Vec2> expected = model.um(beads);
  if (expected.empty()) return;
  for (Vec2& u : expected) u = 1 / as.pixel_size_um * rotated(u, -angle_rad);
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

}  // namespace

Measured measured_beads(const std::shared_ptr<const Side>& relaxed, const images::Image& image,
                        const images::Image& stressed, const Setting& as, const PlacedModel& model) {
  const TrackParameters& parameters = as.parameters;
  const auto sharp = std::make_shared<const Scene>(scene_of(
      relaxed, side_of(stressed, relaxed->bead_sigma, parameters.detection_snr, "stressed", as.threads), as.threads));
  const auto scene = alike_wide(sharp, image, stressed);
  auto [tracks, n_by_grid, period_px, has_gaps] =
      followed_and_measured(*scene, as, 4 * scene->spacing());  // sixteen beads
  recover(*scene, parameters.least_similarity, tracks);
  constexpr int kRounds = 2;  // what the first one mends makes the model better
  for (int round = 0; model.um && round < kRounds; ++round) {
    follow_beside(model, *scene, as, tracks);
  }
  Pooling pooling = pooled(*scene, parameters.outlier_threshold, tracks);  // flags matches, too, made without a window
  if (as.turn) flag_turned_out(*scene, *as.turn, tracks);                  // those found again
  require_common_beads(n_by_grid, n_good(tracks), scene->n_beads());
  const BeadSizes sizes = sizes_of(*sharp, tracks);
  return {.scene = scene,
          .tracks = std::move(tracks),
          .pooling = std::move(pooling),
          .sizes = sizes,
          .period_px = period_px};
}

Tried tried_windows(const Texture& relaxed, const Texture& stressed, double window_px, const Setting& as,
                    const Gaps* gaps, double spacing_px) {
  const Windows windows = windows_on(relaxed, stressed, window_px, as.threads, spacing_px);
  const auto scene = std::make_shared<const Scene>(windows.scene);
  TrackParameters parameters = as.parameters;
  parameters.least_similarity = least_similarity(relaxed, window_px);
  // a square of seven Gaussian sigmas is halved on the finer grid, and holds as much as the Gaussian then
  auto [tracks, n_by_grid, period_px, has_gaps] =
      followed_and_measured(*scene, {as.turn, parameters, as.pixel_size_um, as.threads}, 7 * window_px, gaps);
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

Measured measured_windows(const Texture& relaxed, const images::Image& stressed, const Setting& as, const Gaps* gaps) {
  const Texture moved = texture_of(stressed, relaxed.spot_sigma_px, "stressed");
  std::optional<Tried> best;
  int n_by_grid = 0, n_found = 0, n_tried = 0;
  for (const double window_px : window_sigmas(relaxed)) {
    Tried tried = tried_windows(relaxed, moved, window_px, as, gaps);
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

}  // namespace mbtfm::beads
