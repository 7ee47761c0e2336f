/// A component of pixels, or a polygon, as the ellipse of equal second moments.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"
#include "segment/images/image.h"

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

/// Area, centroid and the ellipse of equal second moments of a polygon, scaled to its area.
///
///   A = ½ Σ c_i,  ∫x² = 1/12 Σ c_i (x_i² + x_i x_j + x_j²),  ∫xy = 1/24 Σ c_i (x_i y_j + 2 x_i y_i + 2 x_j y_j + x_j
///   y_i)
///
/// with j = i + 1 and c_i = x_i y_j − x_j y_i (Green's theorem).
/// @param polygon  of an area other than 0
/// @throws InvalidData where it crosses itself so that it has no such ellipse
Adhesion ellipse_of_polygon(const Polygon& polygon);

/// Distance (um) from a point to the rim of the ellipse grown by nothing: negative inside. First order in the distance
/// (the implicit function over its gradient), within a few per cent for points nearer than the minor axis.
double distance_to_ellipse_um(const Adhesion& adhesion, Vec2 point_um);

/// The pixel, of n along this axis, that a place lies in.
inline int pixel_at(double at_um, double pixel_um, int n) {
  return std::clamp(static_cast<int>(std::floor(at_um / pixel_um)), 0, n - 1);
}

/// Median of an image's pixels of the background between 0.3 and 1 um around an ellipse; nothing where there are none.
/// @param is_background  (column, row, centre_um), asked of all pixels of a box around the ring
std::optional<double> level_around(const Adhesion& adhesion, const images::Image& image, double pixel_um,
                                   const std::function<bool(int, int, Vec2)>& is_background);

}  // namespace mbtfm::cells
