/// Standard errors over gels, densities and noises, and what it takes to reach a target.
#pragma once

#include <vector>

#include "mbtfm/plan/experiment.h"
#include "mbtfm/plan/plan.h"
#include "mbtfm/plan/precision.h"

namespace mbtfm::plan {

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

/// Beads at other places, with noise; a segmentation with its errors; meshes that are not the cell's own. Fitted as a
/// cell is.
Drawn draw_experiments(const Scene& scene, const Computed& computed, const Point& point, int n_experiments,
                       const Work& work);

}  // namespace mbtfm::plan
