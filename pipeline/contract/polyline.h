/// Along and near open lines.
#pragma once

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

}  // namespace mbtfm
