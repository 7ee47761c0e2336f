/// Plane geometry for drawing.
#pragma once

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"

namespace mbtfm::drawing {

inline Vec2 direction(double angle_rad) { return {std::cos(angle_rad), std::sin(angle_rad)}; }
inline Vec2 unit(Vec2 a) { return (1 / norm(a)) * a; }
inline Vec2 left_of(Vec2 a) { return {-a.y, a.x}; }

/// Points at equal arc lengths of about `spacing_um` along a line, its ends included.
Polyline resampled(const Polyline& line, double spacing_um);
/// The same along a closed line.
Polygon resampled_closed(const Polygon& polygon, double spacing_um);
/// A closed line of equally spaced points after a Gaussian of `sigma_um` along its arc length.
Polygon smoothed_closed(const Polygon& polygon, double sigma_um);
/// The tangent at point i.
Vec2 tangent(const Polyline& line, std::size_t i);
/// A parabola from `a` to `b` whose middle lies `sag_um` to the left of the chord.
Polyline parabola(Vec2 a, Vec2 b, double sag_um, double spacing_um);

/// Do the ellipses come nearer than the clearance? (to the fineness of 24 points on each)
bool too_near(const Adhesion& a, const Adhesion& b, double clearance_um);

/// An ellipse of this area, length over width and orientation.
Adhesion make_adhesion(Vec2 position_um, double area_um2, double aspect, double angle_rad);

}  // namespace mbtfm::drawing
