#include "segment/track.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/csv.h"
#include "pipeline/contract/effects.h"
#include "pipeline/contract/errors.h"
#include "segment/alignment.h"
#include "segment/beads.h"
#include "segment/coarse_field.h"
#include "segment/far_field.h"
#include "segment/follow.h"
#include "segment/measure.h"
#include "segment/pool.h"
#include "segment/scene.h"

namespace mbtfm::segment {
namespace {

Drift drift_kind(const std::string& name) {
  return name == "translation" ? Drift::translation : name == "rotation" ? Drift::rotation : Drift::similarity;
}

int search_window(const Scene& scene, const TrackParameters& parameters, double pixel_size_um) {
  // sixteen beads make the right peak stand out; shifts are found up to half a window
  double needed = std::max(64.0, 4 * scene.spacing());
  if (parameters.largest_displacement_um > 0) {
    needed = std::max(needed, 2.2 * parameters.largest_displacement_um / pixel_size_um);
  }
  int window = 32;
  while (window < needed) window *= 2;
  return window;
}

void require_numbers(const Image& image, const char* which) {
  for (int j = 0; j < image.height; ++j) {
    for (int i = 0; i < image.width; ++i) {
      if (std::isfinite(image.at(i, j))) continue;
      throw InvalidData(std::string("the ") + which + " image", "a number in every pixel",
                        "none at column " + std::to_string(i + 1) + ", row " + std::to_string(j + 1));
    }
  }
}

/// A turn that is taken for displacement is a wrong field, however well its beads were found.
void require_no_turn(const FarField& far, Drift kind) {
  if (kind != Drift::translation || !far.is_turned) return;
  throw InvalidData("the stressed image", "a far field that is shifted at most (effects.drift_rotation = off)",
                    "one turned by " + brief(far.turn_rad * 180 / std::numbers::pi) + " degrees");
}

struct Measured {
  std::vector<Track> tracks;
  Pooling pooling;
};

/// As of each of these kinds.
std::vector<FarField> far_fields_of(const Scene& scene, const Measured& measured, const TrackParameters& parameters,
                                    const std::vector<Drift>& kinds) {
  const auto& [tracks, pooling] = measured;
  std::vector<Vec2> positions, displacements;
  double squares = 0;
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    if (!tracks[k].is_good()) continue;
    squares += pooling.beads[k].sigma_px * pooling.beads[k].sigma_px;
    positions.push_back(scene.relaxed->positions[k]);
    displacements.push_back(pooling.beads[k].u);
  }
  const Plane& plane = scene.relaxed->image.plane;
  const double noise = std::sqrt(squares / std::max<double>(1, static_cast<double>(positions.size())));
  return far_fields(positions, displacements, plane.width, plane.height,
                    parameters.far_field_share * std::min(plane.width, plane.height), kinds, noise);
}

constexpr const char* kRotation = "drift rotation";

/// About the drift; a hundredth of the beads may move further, as outliers do.
double largest_displacement_px(const std::vector<Track>& tracks, const Pooling& pooling, const FarField& far,
                               const Scene& scene) {
  std::vector<double> lengths;
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    if (!tracks[k].is_good()) continue;
    lengths.push_back(norm(pooling.beads[k].u - far.drift.at(scene.position(static_cast<int>(k)))));
  }
  return lengths.empty() ? 0 : quantile(std::move(lengths), 0.99);
}

/// Drift rotation: where the turn, found together with the cell's own tail, displaces the border by more than the
/// tolerance, of the largest displacement, and by more than three of its standard errors.
Effect decide_rotation(const FarField& turned, double largest_px, const Plane& plane, double tolerance) {
  if (!turned.is_at_rest) return decided(kRotation, "auto", false, "no place is at rest that would show a turn");
  const double arm_px = 0.5 * std::min(plane.width, plane.height), unit_px = std::max(largest_px, 1e-9);
  const double threshold = std::max(tolerance, 3 * turned.turn_sigma_rad * arm_px / unit_px);
  return decided(kRotation, "auto", std::abs(turned.drift.turn_rad) * arm_px / unit_px, threshold,
                 "a turn of " + brief(turned.drift.turn_rad * 180 / std::numbers::pi) + " +- " +
                     brief(turned.turn_sigma_rad * 180 / std::numbers::pi) +
                     " degrees displaces the border, over the largest displacement, by");
}

/// The beads that left the stressed image when it was turned.
void flag_turned_out(const Scene& scene, const Turn& turn, std::vector<Track>& tracks) {
  const Plane& plane = scene.stressed.image.plane;
  const double margin = 2 * scene.bead_sigma();
  for (int k = 0; k < scene.n_beads(); ++k) {
    const Vec2 there = turn.of(scene.position(k) + tracks[k].found.motion.u);
    const double inside = std::min({there.x, there.y, plane.width - 1 - there.x, plane.height - 1 - there.y});
    if (inside < margin) tracks[k].flag = "edge";
  }
}

/// Measured in the narrow window, even where beads are loose or not resolved and single ones scatter: a wider window
/// would hide the scatter and flatten the peaks.
Measured measured_beads(const Scene& scene, std::vector<Track> tracks, const std::optional<Turn>& turn,
                        const TrackParameters& parameters) {
  measure(scene, parameters.least_similarity, tracks);
  verify(scene, tracks);
  if (turn) flag_turned_out(scene, *turn, tracks);
  flag_outliers(scene, parameters.outlier_threshold, tracks);
  recover(scene, parameters.least_similarity, tracks);
  if (turn) flag_turned_out(scene, *turn, tracks);  // those found again
  Pooling pooling = pooled(scene, tracks);
  return {std::move(tracks), std::move(pooling)};
}

Tracking tracking_of(const Scene& scene, const std::vector<Track>& tracks, const Pooling& pooling, const FarField& far,
                     double pixel_size_um) {
  Tracking result;
  result.far_field_rms_um = pixel_size_um * far.rms;
  result.noise_um = pixel_size_um * far.noise;
  result.has_far_field = far.is_at_rest;
  result.scatter_um = pixel_size_um * pooling.scatter_px;
  result.bead_sigma_um = pixel_size_um * scene.bead_sigma();
  result.n_beads_stressed = static_cast<int>(scene.stressed.beads.size());
  for (int k = 0; k < scene.n_beads(); ++k) {
    const Pooled& found = pooling.beads[k];
    const Vec2 place = scene.position(k);
    result.field.push_back({.position_um = pixel_size_um * (place + Vec2{0.5, 0.5}),
                            .displacement_um = pixel_size_um * (found.u - far.drift.at(place)),
                            .sigma_um = pixel_size_um * found.sigma_px,
                            .flag = tracks[k].flag});
    if (tracks[k].is_good()) ++result.n_good;
  }
  return result;
}

struct DriftOfAll {
  FarField far;
  Effect rotation;
};

/// What the whole image did, with a turn or without. @param turn  by which it was turned back before, if any
DriftOfAll drift_of_all(const Scene& scene, const Measured& measured, const TrackParameters& parameters,
                        const std::string& kind, const std::optional<Turn>& turn) {
  const Drift first = kind == "auto" ? Drift::translation : drift_kind(kind);
  std::vector<Drift> kinds = {first};
  if (kind == "auto") kinds.push_back(Drift::rotation);
  const std::vector<FarField> far = far_fields_of(scene, measured, parameters, kinds);
  DriftOfAll result{far.front(), decided(kRotation, first == Drift::translation ? "off" : "on", true, "as asked")};
  require_no_turn(result.far, first);
  if (kind == "auto") {
    const Stopwatch watch;
    const double largest_px = largest_displacement_px(measured.tracks, measured.pooling, result.far, scene);
    result.rotation = decide_rotation(far[1], largest_px, scene.relaxed->image.plane, parameters.effect_tolerance);
    if (result.rotation.is_on) result.far = far[1];
    result.rotation.seconds = watch.seconds();
  } else if (parameters.drift == "auto") {
    const double all_rad = turn->angle_rad + result.far.drift.turn_rad;
    result.rotation = decided(kRotation, "auto", true,
                              "unturned, the images do not fit together; turned by " +
                                  brief(all_rad * 180 / std::numbers::pi) + " degrees they do");
  }
  return result;
}

}  // namespace

void declare(ParameterList& list, TrackParameters& p) {
  list.table("");
  list.add("pixel_size_um", p.pixel_size_um, Range::pixel_um(),
           "side of a pixel in the specimen (um); unset: from the image's own calibration");
  list.table("track");
  declare(list, p.stressed_plane, "stressed", "the stressed bead image");
  declare(list, p.relaxed_plane, "relaxed", "the relaxed bead image");
  list.add(
      "stressed_last", p.stressed_last, {.low = 0},
      "last stressed_time, or stressed_page, of a time series, each tracked against the relaxed image; 0: one image");
  list.add("detection_snr", p.detection_snr, Range::factor(), "height of a bead over the noise (standard deviations)");
  list.add("largest_displacement_um", p.largest_displacement_um, Range::between(0, 100),
           "how far to look for a bead, after the drift (um); 0: 32 pixels, further where beads are sparse");
  list.add("drift_growth", p.drift_growth,
           "take growth of the whole image by a few per cent for drift, too, beside a turn: a gel that swells");
  list.add(
      "far_field_share", p.far_field_share, Range::between(0.01, 0.5),
      "width of the frame along the border that is taken for far from the cell, for the drift (share of the side)");
  list.add("least_similarity", p.least_similarity, Range::between(0, 1),
           "least correlation of a bead's surroundings in both images");
  list.add("outlier_threshold", p.outlier_threshold, Range::factor(),
           "difference from the neighbours that flags a bead (robust standard deviations)");
  list.add("x_column", p.x_column, "column of --displacement: position in the relaxed state");
  list.add("y_column", p.y_column, "column of --displacement");
  list.add("ux_column", p.ux_column, "column of --displacement: stressed minus relaxed position");
  list.add("uy_column", p.uy_column, "column of --displacement");
  list.add("sigma_column", p.sigma_column,
           "column of --displacement: standard error of a component; where there is none, from the neighbours");
  list.add("length_unit", p.length_unit,
           "of --displacement: um, or px (0 at the centre of the first pixel, of pixel_size_um)", {"um", "px"});
}

RelaxedBeads::RelaxedBeads(const Image& relaxed, const TrackParameters& parameters, int threads)
    : parameters_(parameters), threads_(threads) {
  require_numbers(relaxed, "relaxed");
  const double rough_background = 12;  // px: six sigmas of an ordinary bead; set from the bead itself afterwards
  const double bead_sigma = bead_sigma_of(without_background(relaxed, rough_background));
  Side side = side_of(relaxed, bead_sigma, parameters.detection_snr, "relaxed", threads);
  side.around = beads_around(side, threads);
  side_ = std::make_shared<const Side>(std::move(side));
}

Tracking RelaxedBeads::track(const Image& stressed, double pixel_size_um, const Progress& progress) const {
  if (parameters_.drift != "auto") return track_as(parameters_.drift, stressed, pixel_size_um, progress);
  try {
    return track_as("auto", stressed, pixel_size_um, progress);
  } catch (const InvalidData& unturned) {  // turned so far that its beads are not met with again?
    try {
      return track_as("rotation", stressed, pixel_size_um, progress);
    } catch (const InvalidData&) {
      throw unturned;
    }
  }
}

Tracking RelaxedBeads::track_as(const std::string& kind, const Image& stressed, double pixel_size_um,
                                const Progress& progress) const {
  const auto tell = [&](double fraction, const char* what) {
    if (progress) progress(fraction, what);
  };
  const Plane& plane = side_->image.plane;
  const auto size = [](int width, int height) { return std::to_string(width) + " x " + std::to_string(height); };
  if (plane.width != stressed.width || plane.height != stressed.height) {
    throw InvalidData("the stressed image", "the relaxed image's " + size(plane.width, plane.height) + " pixels",
                      size(stressed.width, stressed.height));
  }
  require_numbers(stressed, "stressed");
  tell(0, "finding beads");
  std::optional<Turn> turn;
  if (kind != "auto" && drift_kind(kind) != Drift::translation) {
    const Plane light = without_background(stressed, background_sigma(side_->bead_sigma));
    turn = turn_between(plane, light, side_->bead_sigma, threads_);
    if (!turn) require_common_beads(0, 0, static_cast<int>(side_->beads.size()));
  }
  const Scene scene = scene_of(side_,
                               side_of(turn ? turned_back(stressed, *turn, threads_) : stressed, side_->bead_sigma,
                                       parameters_.detection_snr, "stressed", threads_),
                               threads_);
  tell(0.3, "correlating windows");
  const Plane& moved = scene.stressed.image.plane;
  const GridField grid = coarse_field(plane, moved, search_window(scene, parameters_, pixel_size_um), threads_);
  tell(0.5, "registering beads");
  Followed followed = follow(scene, grid, parameters_);
  tell(0.7, "measuring beads");
  const Measured measured = measured_beads(scene, std::move(followed.tracks), turn, parameters_);
  const std::vector<Track>& tracks = measured.tracks;
  require_common_beads(followed.n_by_grid, n_good(tracks), scene.n_beads());
  const Pooling& pooling = measured.pooling;
  const auto [far, rotation] = drift_of_all(scene, measured, parameters_, kind, turn);
  Tracking result = tracking_of(scene, tracks, pooling, far, pixel_size_um);
  result.rotation = rotation;
  const GlobalMotion& drift = far.drift;
  const Vec2 centre = drift.centre + drift.shift;
  result.drift_um = pixel_size_um * ((turn ? turn->of(centre) : centre) - drift.centre);
  result.turn_rad = rotation.is_on ? drift.turn_rad + (turn ? turn->angle_rad : 0) : far.turn_rad;
  result.growth = drift.growth;
  return result;
}

Tracking track_beads(const Image& relaxed, const Image& stressed, double pixel_size_um,
                     const TrackParameters& parameters, int threads, const Progress& progress) {
  return RelaxedBeads(relaxed, parameters, threads).track(stressed, pixel_size_um, progress);
}

}  // namespace mbtfm::segment
