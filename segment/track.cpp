#include "segment/track.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/csv.h"
#include "pipeline/contract/effects.h"
#include "pipeline/contract/errors.h"
#include "segment/alignment.h"
#include "segment/beads.h"
#include "segment/coarse_field.h"
#include "segment/common_motion.h"
#include "segment/follow.h"
#include "segment/given_field.h"
#include "segment/measure.h"
#include "segment/pool.h"
#include "segment/scene.h"

namespace mbtfm::segment {
namespace {

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

struct Measured {
  std::vector<Track> tracks;
  Pooling pooling;
};

/// What moved the good beads together, px. @param setting  as of TrackParameters::drift_affine
MotionTaken motion_of_all(const Scene& scene, const Measured& measured, const std::string& setting, double tolerance) {
  std::vector<Vec2> positions, displacements;
  for (int k = 0; k < scene.n_beads(); ++k) {
    if (!measured.tracks[k].is_good()) continue;
    positions.push_back(scene.position(k));
    displacements.push_back(measured.pooling.beads[k].u);
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

Tracking tracking_of(const Scene& scene, const Measured& measured, const MotionTaken& all, double pixel_size_um) {
  const auto& [tracks, pooling] = measured;
  Tracking result;
  result.far_field_rms_um = pixel_size_um * all.rms;
  result.noise_um = pixel_size_um * all.noise;
  result.scatter_um = pixel_size_um * pooling.scatter_px;
  result.bead_sigma_um = pixel_size_um * scene.bead_sigma();
  result.n_beads_stressed = static_cast<int>(scene.stressed.beads.size());
  result.affine = all.affine;
  for (int k = 0; k < scene.n_beads(); ++k) {
    const Pooled& found = pooling.beads[k];
    const Vec2 place = scene.position(k);
    result.field.push_back({.position_um = pixel_size_um * (place + Vec2{0.5, 0.5}),
                            .displacement_um = pixel_size_um * (found.u - all.motion.at(place)),
                            .sigma_um = pixel_size_um * found.sigma_px,
                            .flag = tracks[k].flag});
    if (tracks[k].is_good()) ++result.n_good;
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
  list.add("may_push", p.may_push,
           "the cell may push its gel outward; otherwise that is taken for exchanged images, an error");
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
  if (parameters_.drift_affine != "auto") return track_as(parameters_.drift_affine, stressed, pixel_size_um, progress);
  const auto turned_back_first = [&] {
    Tracking turned = track_as("on", stressed, pixel_size_um, progress);
    turned.affine = decided(
        turned.affine.name, "auto", true,
        "unturned, the images do not fit together; with " + affine_in_words(turned.common) + " taken off they do");
    return turned;
  };
  try {
    Tracking unturned = track_as("auto", stressed, pixel_size_um, progress);
    // A turn is its angle and nothing else while it is small: 0.01 shortens lengths by 5e-5.
    constexpr double kSmall_rad = 0.01;
    return std::abs(unturned.common.turn_rad) <= kSmall_rad ? unturned : turned_back_first();
  } catch (const ExchangedImages&) {
    throw;
  } catch (const InvalidData& unturned) {  // turned so far that its beads are not met with again?
    try {
      return turned_back_first();
    } catch (const InvalidData&) {
      throw unturned;
    }
  }
}

Tracking RelaxedBeads::track_as(const std::string& setting, const Image& stressed, double pixel_size_um,
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
  if (setting == "on") {
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
  require_common_beads(followed.n_by_grid, n_good(measured.tracks), scene.n_beads());
  const MotionTaken all = motion_of_all(scene, measured, setting, parameters_.effect_tolerance);
  require_shift_alone(all);
  Tracking result = tracking_of(scene, measured, all, pixel_size_um);
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

Tracking track_beads(const Image& relaxed, const Image& stressed, double pixel_size_um,
                     const TrackParameters& parameters, int threads, const Progress& progress) {
  return RelaxedBeads(relaxed, parameters, threads).track(stressed, pixel_size_um, progress);
}

}  // namespace mbtfm::segment
