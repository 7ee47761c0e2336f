/// Ellipses that carry an evenly spread load: checks, and rules that average a smooth function over one.
#pragma once

#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm::substrate {

/// The patch over which a force is spread evenly.
struct Ellipse {
  Vec2 centre_um;
  double semi_major_um = 0;
  double semi_minor_um = 0;
  double angle_rad = 0;  ///< of the major axis, from +x towards +y
};

/// @throws InvalidData where an axis is not positive, the axes are swapped or a number is not finite
void check(const std::vector<Ellipse>& ellipses);
/// @throws InvalidData where a coordinate is not finite
void check_points(const std::vector<Vec2>& points_um);
void check_points(const std::vector<Vec3>& points_um);

/// A point of a quadrature rule on the unit disc; the weights of a rule sum to 1.
struct DiscPoint {
  Vec2 position;
  double weight = 0;
};

/// A rule that averages polynomials over the unit disc exactly up to `degree`: 4 points for 3, 7 for 5, else rings at
/// the square roots of Gauss points. Source: Stroud, Approximate Calculation of Multiple Integrals (1971), S2.
std::vector<DiscPoint> disc_rule(int degree);

/// The rule's points on the ellipse, relative to its centre.
std::vector<DiscPoint> ellipse_rule(const Ellipse& ellipse, int degree);

/// Half the sides of the smallest axis-parallel rectangle around the ellipse.
Vec2 half_extent_um(const Ellipse& ellipse);

}  // namespace mbtfm::substrate
