/// Lines brought to the resolution of the mesh.
#pragma once

#include <functional>
#include <vector>

#include "network/mesh/size_field.h"
#include "pipeline/contract/geometry.h"

namespace mbtfm::mesh {

/// The polyline with fewer points, nowhere further than `tolerance_um` from it (Douglas & Peucker 1973).
Polyline simplified(const Polyline& points_um, double tolerance_um);

/// The polyline without the inner points that make a piece shorter than `shortest_um`; its ends stay.
Polyline without_short_pieces(Polyline points_um, double shortest_um);

/// Where to cut a line so that each piece has about the wanted length there.
/// @param size_um  wanted length as a function of the arc length
/// @param fewest  pieces
std::vector<double> even_division_um(double length_um, const std::function<double(double)>& size_um, int fewest);

/// Points that divide the line so; its ends not among them.
Polyline evenly_divided(const Polyline& points_um, const SizeField& size, int fewest);

/// The polyline with points added so that no piece is longer than `longest_um`.
Polyline densified(const Polyline& points_um, double longest_um);

/// `n` points at equal steps of arc length along the closed line.
Polygon evenly_resampled(const Polygon& polygon, int n);

}  // namespace mbtfm::mesh
