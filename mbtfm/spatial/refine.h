/// Smaller faces of tractions where a first reconstruction asks for them.
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

}  // namespace mbtfm::spatial
