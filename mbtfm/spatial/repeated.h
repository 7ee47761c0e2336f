/// Reconstructions that are repeated as the first one asks: with smaller faces of tractions, on a gel that it strains.
#pragma once

#include <functional>

#include "mbtfm/spatial/reconstruction.h"

namespace mbtfm::spatial {

/// By face. Resolved: at a corner the resolution is finer than two sides, which is the finest that the face shows, and
/// the tractions are not what noise makes once in a hundred times. Never by size alone: peaks of the noise are large,
/// too. Threshold: the two fifths with the largest tractions.
/// @param reconstruction  with a covariance and `resolved` for the first
std::vector<bool> faces_to_split(const Problem& problem, const SpatialReconstruction& reconstruction, Refine rule);

struct Refined {
  Problem problem;
  SpatialReconstruction reconstruction;
  int n_split = 0;
};
/// The reconstruction on a mesh with these faces split, those with the largest tractions first, up to kMostVertices.
/// @param remade  the problem on another mesh
/// @param again   the reconstruction of a problem
Refined refined(Problem problem, SpatialReconstruction found, Refine rule,
                const std::function<Problem(TractionMesh)>& remade,
                const std::function<SpatialReconstruction(const Problem&)>& again);

/// The root mean square of the tractions, by their own squares, as these make the squares of the displacement.
double mean_traction_kPa(const Problem& problem, const VectorXd& traction_kPa);

/// Whether they call for large strains, by the switch and the material; its number is what linear theory leaves out of
/// the displacement. @throws UsageError as choice::decide
Effect decide_strain(const Problem& problem, const VectorXd& traction_kPa, const substrate::SubstrateParameters& gel);

/// Gauss and Newton: the gel's tangent about the tractions found, and the tractions again, until they stay.
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
