/// Standard errors over gels, densities and noises, and what it takes to reach a target.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mbtfm/plan/experiment.h"
#include "mbtfm/plan/precision.h"

namespace mbtfm::plan {

/// What is estimated. Of those that there are many of in a cell the plan gives the middle one.
enum class Quantity {
  fibres,
  dorsal,
  arc,
  ventral,
  edge,
  network_force,
  total_force,
  adhesion_force,
  free_force,
  fttc_force
};
constexpr auto words(Quantity) {
  return std::array{
      "fibre",         "dorsal fibre", "transverse arc", "ventral fibre",        "edge fibre",
      "network force", "total force",  "adhesion force", "adhesion force alone", "adhesion force by FTTC"};
}

/// Of a quantity at a point. Of many, medians; share_within counts. fttc_force has no bound: its errors are those of
/// one drawn experiment.
struct Expected {
  Point point;
  Quantity quantity = Quantity::fibres;
  int n = 0;
  double standard_error_nN = 0;
  double from_beads_nN = 0, from_mesh_nN = 0, from_segmentation_nN = 0, from_other_nN = 0;
  double target_nN = 0;
  double share_within = 0;  ///< of the n
  double smallest_seen_nN = 0;
  std::optional<double> least_distance_um;  ///< of two adhesions that free forces tell apart; none: they never do
  double largest_displacement_um = 0;
  double left_out = 0;  ///< of the displacement, by linear elasticity
};

/// What a cell on a gel needs. No less than the least density that was asked for: few beads tell less than the law has
/// it.
struct Needed {
  double youngs_modulus_kPa = 0, noise_um = 0;
  std::optional<double> beads_per_um2;  ///< so that the middle fibre meets the target; none: no number of beads does
  double of_most = 0;                   ///< the same of nine fibres in ten; infinite: none
};

struct Grid {
  std::vector<Expected> expected;
  std::vector<Needed> needed;  ///< by gel, then noise
  std::vector<std::string> warnings;
  double touching_um = 0;     ///< distance of two adhesions of the median size that touch
  double model_error_nN = 0;  ///< of the middle fibre, however many beads there are
  /// Of three standard errors is the smallest force seen: chance passes it once in 700 times.
  static constexpr double kSeen = 3;
};

/// No more beads can be told apart: their images melt together.
double most_beads_per_um2(const Scene& scene);

/// @throws UsageError where so few beads tell nothing, or so many melt together
void check_densities(const Scene& scene, const std::vector<double>& beads_per_um2);

/// One gel stands for all: its answer falls with the modulus. @see Precision
struct Computed {
  KnownCell cell;
  BeadsOnGel densest;
  Densities densities;
  ModelErrors model;
};
/// @throws as check_densities
Computed compute(const Scene& scene, const Asked& asked, const Work& work);

Grid grid_of(const Scene& scene, const Asked& asked, const Computed& computed, int threads);

/// By the beads' noise alone, for a noise of 1 um on 1 kPa: between the densities computed on the line of logarithms,
/// beyond them as the law has it, with the root of the density.
double unit_error(const Densities& densities, std::size_t label, double beads_per_um2);
/// Standard error of a tension by everything, at a point.
double standard_error_nN(const Computed& computed, std::size_t label, const Point& point);

}  // namespace mbtfm::plan
