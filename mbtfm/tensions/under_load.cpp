#include "mbtfm/tensions/under_load.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/stopwatch.h"
#include "pipeline/files/csv.h"
#include "pipeline/stage/effects.h"

namespace mbtfm::tensions {

namespace {

/// What independent forces leave of the beads. Of exact data that is rounding, and says nothing.
double left_by_forces(const ReducedData& reduced, double floor_squared) {
  constexpr double kRounding = 1e-10;  // of the squares; those of G'G are rounded to its condition
  return std::max(floor_squared, kRounding * (reduced.floor_squared + reduced.target.squaredNorm()));
}

/// Twice the logarithm of the odds of the other state.
/// @param floor_squared  what independent forces leave in that state
double evidence_of(const LinearData& data, const ReducedData& other, double floor_squared) {
  return static_cast<double>(data.n_used) *
         std::log(left_by_forces(data.reduced, data.reduced.floor_squared) / left_by_forces(other, floor_squared));
}

double largest_displacement_um(const DisplacementField& beads) {
  double largest = 0;
  for (const Bead& b : beads) largest = std::max(largest, norm(b.displacement_um));
  return largest;
}

}  // namespace

DisplacementField under_load(DisplacementField beads) {
  for (Bead& b : beads) b.position_um += b.displacement_um;
  return beads;
}

BeadsOfState take_state(const DisplacementField& at_rest, LinearData data,
                        const std::function<LinearData(const DisplacementField&)>& data_of, double size_um,
                        double tolerance, Switch setting, const Carried& carried) {
  constexpr EffectKind kKind = EffectKind::beads_under_load;
  constexpr double kVeryStrong = 10;
  constexpr double kHopeless = -100;  // estimates of -230 to -450 were -350 to -470
  const Stopwatch watch;
  BeadsOfState result{.beads = at_rest, .data = std::move(data), .effect = {}};
  const double largest = largest_displacement_um(at_rest);
  if (setting == Switch::off || (setting == Switch::automatic && !(largest > tolerance * size_um))) {
    result.effect = stage::decided(kKind, setting, largest / size_um, tolerance,
                                   "over the size of an adhesion the largest displacement is");
    return result;
  }
  if (setting == Switch::automatic && carried) {  // the exact answer costs as much as all that went before
    const VectorXd there = result.data.displacement_um - carried(result.data);
    const double estimate = evidence_of(result.data, result.data.reduced, explained(result.data, there).floor_squared);
    if (estimate < kHopeless) {
      result.effect = stage::decided(
          kKind, setting, estimate, kHopeless,
          "twice the logarithm of the odds, estimated with the forces that explain the beads at rest, is");
      result.effect.seconds = watch.seconds();
      return result;
    }
  }
  DisplacementField moved = under_load(at_rest);
  LinearData loaded = data_of(moved);
  const double evidence = evidence_of(result.data, loaded.reduced, loaded.reduced.floor_squared);
  result.effect =
      stage::decided(kKind, setting, evidence, kVeryStrong,
                     "twice the logarithm of the odds, by what independent forces of the adhesions leave, is");
  result.effect.seconds = watch.seconds();
  if (!result.effect.is_on) return result;
  result.beads = std::move(moved);
  result.data = std::move(loaded);
  return result;
}

}  // namespace mbtfm::tensions
