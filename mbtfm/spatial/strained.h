/// Tractions that strain the gel beyond linear elasticity.
#pragma once

#include <memory>

#include "mbtfm/spatial/reconstruction.h"

namespace mbtfm::spatial {

/// The root mean square of the tractions, by their own squares, as these make the squares of the displacement.
double mean_traction_kPa(const Problem& problem, const VectorXd& traction_kPa);

/// Whether they call for large strains, by the switch and the material; its number is what linear theory leaves out of
/// the displacement. @throws UsageError as choice::decide
Effect decide_strain(const Problem& problem, const VectorXd& traction_kPa, const substrate::SubstrateParameters& gel);

/// Gauss and Newton: the gel's tangent about the tractions found, and the tractions anew, until they stay.
/// @param at_rest   the problem of small strains
/// @param found     its tractions
/// @param again     finds those of another problem
/// @throws NotSolved where they do not settle, or the gel finds no state under them
struct Strained {
  Problem problem;
  SpatialReconstruction reconstruction;
  int steps = 0;
};
Strained on_strained_gel(const Problem& at_rest, SpatialReconstruction found, const substrate::SubstrateParameters& gel,
                         const std::function<SpatialReconstruction(const Problem&)>& again, int threads);

}  // namespace mbtfm::spatial
