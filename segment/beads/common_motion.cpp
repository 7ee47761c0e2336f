
#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/stopwatch.h"
#include "pipeline/contract/with_error.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/stage/effects.h"
#include "segment/beads/far_field.h"
#include "segment/beads/plane.h"

namespace mbtfm::beads {
namespace {

/// Of the chi² distribution with four degrees of freedom: what one in 370 exceeds.
constexpr double kChiSquared = 16.25;

CommonMotion as_found(const RestingField& rest, const FarField& shifted, const FarField& affine, bool is_taken) {
  const AffineMotion& m = affine.drift;
  const FarField& taken = is_taken ? affine : shifted;
  return {.drift_um = taken.drift.shift,
          .drift_sigma_um = taken.errors.shift,
          .turn_rad = m.turn_rad,
          .turn_sigma_rad = affine.errors.turn_rad,
          .growth = m.growth,
          .growth_sigma = affine.errors.growth,
          .shear = m.shear(),
          .shear_angle_rad = 0.5 * std::atan2(m.skew, m.stretch),
          .shear_sigma = affine.errors.shear,
          .has_far_field = affine.is_at_rest,
          .share_at_rest = rest.share_at_rest,
          .share_of_border_moving = rest.share_of_border_moving,
          .share_of_border_pulled = rest.share_of_border_pulled,
          .pull_of_border = rest.pull_of_border};
}

/// Median misfit of what is at rest, or, where nothing is, of all.
double misfit_of(const RestingField& rest, bool is_at_rest, const AffineMotion& motion) {
  std::vector<double> misfits;
  for (const FieldCell& cell : rest.cells) {
    if (cell.n_beads == 0 || (is_at_rest && !cell.rests)) continue;
    misfits.push_back(norm(cell.u - motion.at(cell.place)));
  }
  return numerics::quantile(std::move(misfits), 0.5);
}

}  // namespace

std::string affine_in_words(const CommonMotion& c) {
  const double degrees = 180 / std::numbers::pi;
  return "a turn of " + with_error(degrees * c.turn_rad, degrees * c.turn_sigma_rad) + " degrees, growth of " +
         with_error(100 * c.growth, 100 * c.growth_sigma) + " % and shear of " +
         with_error(100 * c.shear, 100 * c.shear_sigma) + " %";
}

MotionTaken motion_taken(const std::vector<Vec2>& positions, const std::vector<Vec2>& displacements, Vec2 corner,
                         double width, double height, Switch setting, double tolerance, double large) {
  const Stopwatch watch;
  const WholeMotion whole = whole_motion(positions, displacements, corner, width, height);
  const FarField &shifted = whole.shifted, &affine = whole.affine;
  MotionTaken result;
  const double arm = 0.5 * std::min(width, height), reach = affine.drift.largest_within(arm);
  const double unit = std::max(largest_about(positions, displacements, affine.drift), 1e-12);
  const double seen =
      std::max(1e-3, 1 - whole.rest.share_of_border_moving);  // of the border; beyond it others may pull
  const auto chance = [&](double chi_squared) {
    return reach / unit * std::sqrt(kChiSquared / std::max(chi_squared, 1e-12)) / seen;
  };
  const double threshold = std::max(tolerance, chance(affine.linear_chi_squared));
  constexpr double kCertain = 100;  // ten standard errors: few squares follow any affine motion a little
  result.is_large = reach > large && affine.over_noise > kCertain &&
                    misfit_of(whole.rest, affine.is_at_rest, affine.drift) <
                        0.5 * misfit_of(whole.rest, affine.is_at_rest, shifted.drift);
  result.is_affine = affine.is_at_rest && reach / unit > std::max(tolerance, chance(affine.over_noise));
  const CommonMotion found = as_found(whole.rest, shifted, affine, true);
  if (setting != Switch::automatic) {
    result.affine = stage::decided(EffectKind::affine_drift, setting, true, "as asked");
  } else if (!affine.is_at_rest) {
    result.affine = stage::decided(EffectKind::affine_drift, setting, false, "no place is at rest that would show it");
  } else if (whole.rest.is_cut() && !result.is_large) {
    result.affine = stage::decided(EffectKind::affine_drift, setting, false,
                                   affine_in_words(found) + " may be the pull of a cell that the border cuts");
  } else {
    result.affine = stage::decided(EffectKind::affine_drift, setting, reach / unit, threshold,
                                   affine_in_words(found) + " displace the border, over the largest displacement, by");
  }
  result.affine.seconds = watch.seconds();
  const FarField& taken = result.affine.is_on ? affine : shifted;
  result.motion = taken.drift;
  result.common = as_found(whole.rest, shifted, affine, result.affine.is_on);
  result.common.is_affine = result.is_affine;
  result.rms = taken.rms;
  result.noise = taken.noise;
  result.n_moving = whole.rest.n_moving;
  return result;
}

}  // namespace mbtfm::beads
