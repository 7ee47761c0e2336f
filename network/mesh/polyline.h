/// Lines brought to the resolution of the mesh.
#pragma once

#include "network/mesh/size_field.h"

namespace mbtfm::mesh {

/// The polyline with fewer points, nowhere further than `tolerance_um` from it (Douglas & Peucker 1973).
Polyline simplified(const Polyline& points_um, double tolerance_um);

/// The polyline without the inner points that make a piece shorter than `shortest_um`; its ends stay.
Polyline without_short_pieces(Polyline points_um, double shortest_um);

/// Points that divide the line into pieces of about the wanted length; its ends not among them.
Polyline evenly_divided(const Polyline& points_um, const SizeField& size, int fewest);

/// The polyline with points added so that no piece is longer than `longest_um`.
Polyline densified(const Polyline& points_um, double longest_um);

}  // namespace mbtfm::mesh
