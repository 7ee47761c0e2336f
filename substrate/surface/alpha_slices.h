/// The gel's surface by alpha shapes of slices, as the first studies on curved gels had it: for comparison.
#pragma once

#include <vector>

#include "pipeline/contract/surface.h"

namespace mbtfm::surface {

struct AlphaParameters {
  double slice_um = 0;   ///< width of a slice; 0: twice the beads' distance, n^(-1/3)
  double radius_um = 0;  ///< of the shape's circle; 0: such that one empty circle is due in a slice
};

/// Slices across x; of the beads of each the alpha shape in the plane (y, z), of which the upper rim counts. The rims
/// are joined to a lattice, a line a slice. It lies below the surface by about the beads' distance, since no bead lies
/// on the surface.
/// Source: Edelsbrunner, Kirkpatrick, Seidel, IEEE Trans. Inf. Theory 29 (1983) 551.
/// @throws InvalidData where beads are fewer than 30, a number is not finite, slices are fewer than 4 or one has no
///         shape, by place
HeightMap alpha_shape_surface(const std::vector<Vec3>& beads_um, const AlphaParameters& parameters, double spacing_um);

}  // namespace mbtfm::surface
