/// Inside of the bead tracker: a first displacement field on a grid.
#pragma once

#include "segment/beads/plane.h"
#include "segment/beads/registration.h"

namespace mbtfm::beads {

/// A displacement field on a square grid of points, in px.
struct GridField {
  int nx = 0, ny = 0;
  double spacing = 1;
  Vec2 first;  ///< the first point
  std::vector<Vec2> u;
  double period = 0;  ///< px, of a pattern that repeats itself, as dots in a lattice; 0: it does not
  /// Bilinear between the points, constant beyond them.
  Motion at(Vec2 place) const;
};

/// A grid over the whole plane, as far from one border as from the other; no displacements yet.
GridField grid_over(const Plane& plane, double spacing);

/// Light compressed to −1 … 1, so that a few bright clumps do not decide a window.
Plane compressed(const Plane& plane);

/// Shift of the target as a whole by phase correlation at half the resolution, of a pattern that repeats itself the
/// least that fits; then windows of `window` px (a power of
/// two) are cross-correlated at that resolution, and windows of half that size at full resolution around what the first
/// found; points whose peak is ambiguous or differs from their neighbours' take their neighbours' median.
GridField coarse_field(const Plane& reference, const Plane& target, int window, int threads);

}  // namespace mbtfm::beads
