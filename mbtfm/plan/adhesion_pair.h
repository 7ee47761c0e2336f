/// When beads tell two adhesions apart.
#pragma once

#include <optional>
#include <vector>

#include "pipeline/contract/gel.h"
#include "pipeline/contract/geometry.h"

namespace mbtfm::plan {

/// Two adhesions of one size that pull alike, on a line along x, at a distance from centre to centre. The fit of two
/// knows where they are, as their image tells, and finds both forces. The fit of one finds the place and the force of a
/// single adhesion of this size. Both have four numbers. They count as told apart where the fit of one misses the beads
/// by more: chi² larger by kTold, odds of 90 to 1, in kChance of all experiments.
inline constexpr double kTold = 9, kChance = 0.8;

/// The squares that the best single adhesion leaves of the two's exact displacement:
///
///   lambda = min over place x and force F₁ of  integral of |u₂ − G(x) F₁|² dA      (um⁴)
///
/// for two forces of 1 nN on a gel of 1 kPa, mean over forces along the line and across it. chi² grows by density /
/// noise² (force/modulus)² of that on average. Half-space: the base is much further than adhesions are from each other.
/// @param distance_um  two radii or more: nearer ones are one
double squares_left_um4(const Gel& gel, double area_um2, double distance_um);

/// That at which chi² passes: with lambda' = density (force / (modulus noise))² lambda, chi² of one less chi² of two
/// has mean lambda' and variance 4 lambda', so it exceeds kTold with the chance kChance where sqrt(lambda') = 0.84 +
/// sqrt(0.84² + kTold).
double needed_squares();

/// The curve of squares_left_um4, computed once for a size.
class PairResolution {
 public:
  PairResolution(const Gel& gel, double area_um2, int threads);
  /// At least the distance at which they touch. None where not even kFarthest_um is enough.
  std::optional<double> least_distance_um(double force_nN, double youngs_modulus_kPa, double beads_per_um2,
                                          double noise_um) const;
  static constexpr double kFarthest_um = 30;
  double touching_um() const { return distance_um_.front(); }

 private:
  std::vector<double> distance_um_, squares_um4_;
};

}  // namespace mbtfm::plan
