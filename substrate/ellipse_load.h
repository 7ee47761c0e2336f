/// A load spread evenly over an ellipse, integrated against functions of one rectangle exactly.
#pragma once

#include <vector>

#include "substrate/ellipse.h"

namespace mbtfm::substrate {

struct Rectangle {
  Vec2 low_um, high_um;
};

/// Quadrature points of an ellipse cut by a rectangle, with weights as shares of the ellipse's area: integrate
/// polynomials of degree 4 to rounding (1e-13). Empty where they do not overlap.
std::vector<DiscPoint> clipped_ellipse_rule(const Ellipse& ellipse, const Rectangle& rectangle);

/// Half the sides of the smallest axis-parallel rectangle around the ellipse.
Vec2 half_extent_um(const Ellipse& ellipse);

}  // namespace mbtfm::substrate
