/// The height of a gel's surface between and beyond the vertices of its map.
#pragma once

#include <Eigen/Core>

#include "pipeline/contract/surface.h"
#include "substrate/surface/splines.h"

namespace mbtfm::surface {

/// The bicubic spline through all vertices of a map (third derivatives are even across the lines next to the rim):
/// twice continuously differentiable, of fourth order in the spacing. Beyond the rim it goes on smoothly and fades to
/// the mean height. Source: de Boor, A Practical Guide to Splines (2001), chapters 4 and 17.
class Height {
 public:
  /// @throws InvalidData as check(map)
  explicit Height(const HeightMap& map);

  double operator()(Vec2 at_um) const;
  /// Slopes along x and y, of a place within the map.
  Vec2 slope(Vec2 at_um) const;
  /// Whether a place lies within the map, but for rounding.
  bool contains(Vec2 at_um) const;
  Vec2 low_um() const { return lattice_.corner_um; }
  Vec2 high_um() const { return at_place(lattice_, {1.0 * lattice_.n_x, 1.0 * lattice_.n_y}); }

 private:
  Vec2 nearest(Vec2 at_um) const;

  Lattice lattice_;
  Eigen::VectorXd coefficients_um_;
  double mean_um_ = 0;
};

}  // namespace mbtfm::surface
