/// The surface of a gel from the beads in its volume by alpha shapes of slices (Soiné, thesis 2014, chapter 2): the
/// method of the thesis, to compare with. It hangs on the highest beads, so it lies too deep by a good part of their
/// distance; `fit_beads` does not.
#pragma once

#include <array>
#include <vector>

#include "pipeline/contract/surface.h"

namespace mbtfm::surface {

/// Along which slices lie one behind the other: best that of the crests.
enum class SlicesAlong { kX, kY };
constexpr auto words(SlicesAlong) { return std::array{"x", "y"}; }

struct AlphaParameters {
  double slice_um = 0;  ///< width; 0: twice the beads' distance n^(-1/3)
  /// Of the circle that finds no way between beads (the square root of CGAL's alpha); 0: the smallest with which, in
  /// every slice, one solid piece holds all of its beads but 2 % (strays, and at least one bead may be)
  double radius_um = 0;
  SlicesAlong along = SlicesAlong::kX;
};

/// In each slice the upper boundary of the largest solid piece of its beads' alpha shape (the regularised one), seen
/// along the slices; between the middles of slices linear. The lattice ends with the first and last slice's middle, and
/// where the first of the slices' shapes ends.
///
/// @param spacing_um  of the lattice, at most: whole numbers of it fill the range
/// @throws InvalidData where beads are fewer than 30, not finite, or twice at one place; by place, where a slice has
/// fewer than 3 beads, all on one line, or a shape less than half as wide as the beads; where the range has fewer than
/// 4 x 4 vertices
HeightMap alpha_shape_surface(const std::vector<Vec3>& beads_um, const AlphaParameters& parameters, double spacing_um);

}  // namespace mbtfm::surface
