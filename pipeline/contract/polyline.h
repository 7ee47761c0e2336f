/// Along and near lines.
#pragma once

#include <functional>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"

namespace mbtfm {

/// The point at a share (0 to 1) of the line's length. @param line_um  at least one point
Vec2 point_along_um(const Polyline& line_um, double share);

/// Distance to the nearest point of the line; infinite where it has less than two points.
double distance_to_line_um(const Polyline& line_um, Vec2 point_um);

/// Places on a fibre for its label in a picture, the best first: the middle, then ever nearer to the ends; those where
/// another fibre passes within `clear_um` last.
std::vector<Vec2> label_places_um(const Fibre& fibre, const std::vector<Fibre>& fibres, double clear_um);

/// Where to cut a line so that each piece has about the wanted length there.
/// @param size_um  wanted length as a function of the arc length
/// @param fewest  pieces
std::vector<double> even_division_um(double length_um, const std::function<double(double)>& size_um, int fewest);

/// `n` points at equal steps of arc length along the closed line.
Polygon evenly_resampled(const Polygon& polygon, int n);

}  // namespace mbtfm
