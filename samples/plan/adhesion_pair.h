/// When beads resolve two adhesions.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

#include "pipeline/contract/gel.h"

namespace mbtfm::plan {

/// Two adhesions of one size that pull alike, on a line along x, at a distance from centre to centre. The fit of two
/// knows where they are, as their image shows, and finds both forces. The fit of one finds the place and the force of a
/// single adhesion of this size. Both have four numbers. They count as resolved if the fit of one misses the beads by
/// more: chi² larger by kResolved, odds of 90 to 1, in kChance of all experiments.
inline constexpr double kResolved = 9, kChance = 0.8;

/// chi² of one adhesion's fit less that of the fit of two, in one experiment, over the places of the one: a² times the
/// first column + 2a times the second + the third, where the forces are a times noise and modulus. With beads at places
/// b and their noise n
///
///   first = sum over b |u₂(b) − G F₁|²,  second = n · (u₂ − G F₁),  third = |P₂ n|² − |P₁ n|²
///
/// for the best F₁ without noise; P project on what two forces and one can explain.
using Excess = Eigen::ArrayX3d;

/// Beads below the surface.
struct BeadVolume {
  double depth_um = 0;     ///< down to which they lie
  double axial_noise = 1;  ///< noise along z over that along the surface
};

/// How many experiments are drawn, at how many distances. 800: the distance that four in five resolve is then known to
/// some 4 %.
struct PairDraws {
  int n_distances = 8, n_experiments = 800;
};

/// The least distance, over experiments whose beads lie at random and have noise: the place of the one that fits best
/// is found in each. (Its chi² over the noise cannot be taken at the place that is best without noise: the more so the
/// flatter chi² is over the places, that is, where noise is large and the two are far apart.) With few beads chance
/// decides whether one lies between the two, too.
class PairResolution {
 public:
  PairResolution(const Gel& gel, double area_um2, const std::vector<double>& beads_per_um2, int threads);
  /// Of beads in a volume, which move along z, too, and forces into the gel besides those along it: where nothing else
  /// pulls.
  PairResolution(const Gel& gel, double area_um2, const std::vector<double>& beads_per_um3, const BeadVolume& volume,
                 const PairDraws& draws, int threads);
  /// At least the distance at which they touch. None where not even farthest_um() is enough.
  /// @param density  index in the densities
  std::optional<double> least_distance_um(double force_nN, double youngs_modulus_kPa, std::size_t density,
                                          double noise_um) const;
  static constexpr double kFarthest_um = 30;
  static constexpr double kFarthestInSpace = 12;  ///< in radii, if that is more
  double farthest_um() const { return distance_um_.back(); }
  double touching_um() const { return distance_um_.front(); }

 private:
  std::vector<double> distance_um_;
  std::vector<std::vector<std::vector<Excess>>> excess_;  ///< by distance, density, drawn experiment
};

}  // namespace mbtfm::plan
