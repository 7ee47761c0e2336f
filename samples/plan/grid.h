/// Standard errors over gels, densities and noises, and what it takes to reach a target.
#pragma once

#include <vector>

#include "samples/plan/known_cell.h"
#include "samples/plan/plan.h"

namespace mbtfm::plan {

/// No more beads can be resolved: their images melt together.
double most_beads_per_um2(const Scene& scene);

/// One gel represents all: its answer falls with the modulus. @see Precision
struct Computed {
  KnownCell cell;
  BeadsOnGel densest;
  Densities densities;
  ModelErrors model;
};
/// @throws UsageError if so few beads determine nothing, or so many melt together
Computed compute(const Scene& scene, const Asked& asked, const Work& work);

Grid grid_of(const Scene& scene, const Asked& asked, const Computed& computed, int threads);

/// Of the tensions of fibres, of this type, in KnownCell::fibre_ids.
std::vector<std::size_t> labels_of(const Scene& scene, const KnownCell& cell, std::optional<FibreType> type);
/// By the beads' noise alone, for a noise of 1 um on 1 kPa: between the densities computed on the line of logarithms,
/// beyond them as the law has it, with the root of the density.
double unit_error(const Densities& densities, std::size_t label, double beads_per_um2);
/// Standard error of a tension by everything, at a point.
double standard_error_nN(const Computed& computed, std::size_t label, const Point& point);

/// 1.48 times the median magnitude: the standard deviation of a normal variable.
double robust_error(std::vector<double> magnitudes);
/// Magnitudes of the errors of FTTC's forces along the true ones, by point and adhesion: of one experiment a density,
/// on a part of the densest beads.
std::vector<std::vector<double>> errors_of_fttc_nN(const Scene& scene, const Asked& asked, const Computed& computed,
                                                   int threads);
/// Beads at other places, with noise; a segmentation with its errors; meshes that are not the cell's own. Fitted as a
/// cell is.
Drawn draw_experiments(const Scene& scene, const Computed& computed, const Point& point, int n_experiments,
                       const Work& work);

}  // namespace mbtfm::plan
