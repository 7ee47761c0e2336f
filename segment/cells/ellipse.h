/// A component of pixels as the ellipse of equal second moments.
#pragma once

#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"

namespace mbtfm::cells {

/// A pixel and the share of it, 0 to 1, that the component covers.
struct CoveredPixel {
  int column = 0;
  int row = 0;
  double share = 1;
  double intensity = 0;
};

/// Area, centroid and the ellipse of equal second moments, its axes scaled so that π/4 · major · minor = area.
///
///   A = Σ s,  c = Σ s x / A,  M = Σ s (x − c)(x − c)ᵀ / A + 1/12 px²
///
/// 1/12 px² is the second moment of a pixel itself: without it a row of pixels would have no width. A homogeneous
/// ellipse of semi-axes a, b has the moments a²/4, b²/4. `mean_intensity` is weighted by the shares.
/// @param pixels  at least one with a positive share
Adhesion measure_ellipse(const std::vector<CoveredPixel>& pixels, double pixel_size_um);

/// Distance (um) from a point to the rim of the ellipse grown by nothing: negative inside. First order in the distance
/// (the implicit function over its gradient), within a few per cent for points nearer than the minor axis.
double distance_to_ellipse_um(const Adhesion& adhesion, Vec2 point_um);

}  // namespace mbtfm::cells
