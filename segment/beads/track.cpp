#include "segment/beads/track.h"

#include <algorithm>
#include <cmath>
#include <exception>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/stopwatch.h"
#include "pipeline/stage/effects.h"
#include "pipeline/stage/parameters.h"
#include "segment/beads/given_field.h"
#include "segment/beads/measured.h"

namespace mbtfm::beads {
namespace {

/// Six sigmas of an ordinary bead; set from the bead itself afterwards.
constexpr double kRoughBackground_px = 12;

void require_numbers(const images::Image& image, const char* which) {
  for (int j = 0; j < image.height; ++j) {
    for (int i = 0; i < image.width; ++i) {
      if (std::isfinite(image.at(i, j))) continue;
      throw InvalidData(std::string("the ") + which + " image", "a number in every pixel",
                        "none at column " + std::to_string(i + 1) + ", row " + std::to_string(j + 1));
    }
  }
}

/// A turn that is taken for displacement is a wrong field, however well its beads were found.
void require_shift_alone(const MotionTaken& all) {
  if (all.affine.is_on || !all.is_large) return;
  throw InvalidData("the stressed image", "one that is shifted at most (effects.drift_affine = off)",
                    affine_in_words(all.common));
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
  const double bead_sigma = bead_sigma_of(without_background(relaxed, kRoughBackground_px));
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
  if (!(bead_sigma_of(without_background(image, kRoughBackground_px)) > 0))
    throw NotFollowed("the stressed image", "bright beads on a darker ground", "none");  // no remedy helps
  try {
    return track_by_any(stressed);
  } catch (NotFollowed& error) {
    error.remedy = remedy(stressed);
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
  const Setting as{turn, parameters_, pixel_size_um, threads_};
  Measured measured = by_beads ? measured_beads(side_, relaxed_, unturned, as, {model_, stressed.cell})
                               : measured_windows(*texture_, unturned, as);
  std::vector<Vec2> motions;
  for (const Pooled& bead : measured.pooling.beads) motions.push_back(bead.u);
  const MotionTaken all =
      motion_of_all(*measured.scene, measured.tracks, motions, setting, parameters_.effect_tolerance);
  require_shift_alone(all);
  const Placement own{all.motion, turn}, cell = placement_of_cell(parameters_, stressed.cell, own);
  flag_out_of_sight(*measured.scene, own, measured.tracks);
  Tracking result = tracking_of(measured, all, own, cell, pixel_size_um);
  if (by_beads) result.ghosts = ghosts_of(*measured.scene, measured.tracks, measured.sizes, turn);
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
    windows = measured_windows(*texture_, unturned, {own.turn, parameters_, pixel_size_um, threads_}, &gaps);
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
    const Setting as{own.turn, parameters_, pixel_size_um, threads_};
    const double window_px = measured_windows(*texture_, unturned, as).window_px;
    const Texture moved = texture_of(unturned, texture_->spot_sigma_px, "stressed");
    const double spacing_px = parameters_.windows_spacing_um / pixel_size_um;
    const Tried tried = tried_windows(*texture_, moved, window_px, as, nullptr, spacing_px);
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
