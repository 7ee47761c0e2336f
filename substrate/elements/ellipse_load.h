/// A load spread evenly over an ellipse, integrated against functions of one rectangle exactly.
#pragma once

#include <vector>

#include "pipeline/contract/extent.h"
#include "substrate/ellipse.h"

namespace mbtfm::elements {

/// Quadrature points of an ellipse cut by a rectangle, with weights as shares of the ellipse's area: integrate
/// polynomials of degree 4 to rounding (1e-13). Empty where they do not overlap.
std::vector<substrate::DiscPoint> clipped_ellipse_rule(const substrate::Ellipse& ellipse, const Extent& rectangle);

}  // namespace mbtfm::elements
