/// Bicubic B-splines over a lattice of rectangles: smooth functions of a place, and how much they bend.
#pragma once

#include <Eigen/Core>
#include <array>

#include "pipeline/contract/extent.h"
#include "substrate/surface/band.h"

namespace mbtfm::surface {

/// Rectangles that carry bicubic B-splines.
struct Lattice {
  Vec2 corner_um;
  Vec2 side_um = {1, 1};
  int n_x = 1, n_y = 1;
  int n_splines() const { return (n_x + 3) * (n_y + 3); }
};

/// Nearly squares of this side, a 150th of the longer side of all at least.
Lattice rectangles_over(const Extent& extent, double side_um);

inline constexpr int kLocal = 16;  ///< splines over a rectangle

/// What the splines over one rectangle count at a place.
struct Weights {
  int square = 0;  ///< first coefficient
  std::array<double, kLocal> of{};
};
Weights weights_at(const Lattice& lattice, Vec2 at_um);
/// The same for the slopes along x and y.
struct SlopeWeights {
  Weights x, y;
};
SlopeWeights slope_weights_at(const Lattice& lattice, Vec2 at_um);

/// Coefficient of spline k over a rectangle.
inline int index_of(const Lattice& l, int square, int k) { return square + k % 4 + (l.n_x + 3) * (k / 4); }
/// In sides from the corner.
inline Vec2 place_in(const Lattice& l, Vec2 at) {
  return {(at.x - l.corner_um.x) / l.side_um.x, (at.y - l.corner_um.y) / l.side_um.y};
}
inline Vec2 at_place(const Lattice& l, Vec2 place) {
  return l.corner_um + Vec2{place.x * l.side_um.x, place.y * l.side_um.y};
}
/// Column and row of the rectangle that holds a place, or is nearest to it.
std::array<int, 2> square_of(const Lattice& lattice, Vec2 at_um);

double value_of(const Lattice& lattice, const Weights& weights, const Eigen::VectorXd& coefficients);
double variance_of(const Lattice& lattice, const Weights& weights, const Band& covariance);

struct Smoothing {
  double crest_rad = 0;  ///< direction of the crests, from +x towards +y
  double ratio = 1;      ///< r: how much stiffer the plate is along them
  double stiffness = 1;  ///< gamma
};

/// ∫ s_vv² + 2 r s_uv² + r² s_uu² as a matrix of the coefficients, u along the crests.
Band roughness(const Lattice& lattice, double crest_rad, double ratio);

}  // namespace mbtfm::surface
