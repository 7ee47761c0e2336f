/// Inside of the bead tracker: one image turned against the other, as after a dish was put back on the stage, and a
/// first displacement field on a grid.
#pragma once

#include <optional>

#include "segment/beads/placement.h"
#include "segment/beads/plane.h"
#include "segment/beads/registration.h"

namespace mbtfm::beads {

/// The turn that carries the beads of `relaxed` to those of `stressed`, to half a degree and a few pixels: of turns by
/// up to 30 degrees, a half apart, the one whose pictures correlate best. Nothing where none stands out.
std::optional<Turn> turn_between(const Plane& relaxed, const Plane& stressed, double bead_sigma, int threads);

/// The image as it would be without that turn: result(x) = image(turn(x)).
images::Image turned_back(const images::Image& image, const Turn& turn, int threads);

/// A displacement field on a square grid of points, in px.
struct GridField {
  int nx = 0, ny = 0;
  double spacing = 1;
  Vec2 first;  ///< the first point
  std::vector<Vec2> u;
  double period = 0;  ///< px, of a pattern that repeats itself, as dots in a lattice; 0: it does not
  Vec2 place(std::size_t k) const {
    const auto n = static_cast<std::size_t>(nx);
    return first + spacing * Vec2{static_cast<double>(k % n), static_cast<double>(k / n)};
  }
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

/// The affine motion through the dozen known ones that are nearest, at each point of a lattice.
GridField field_through(const std::vector<Vec2>& places, const std::vector<Motion>& motions, GridField lattice,
                        int threads);

/// The same for motions of up to a third of the picture: windows of twice `window` px are searched that far at a
/// quarter of the resolution, then ever smaller ones in the target deformed back by what was found, so that strains do
/// not blur their peaks (window deformation: Scarano, Meas Sci Technol 13:R1, 2002). Takes some ten times as long.
GridField coarse_to_fine_field(const Plane& reference, const Plane& target, int window, int threads);

}  // namespace mbtfm::beads
