/// Fibre polylines brought to the resolution of the mesh.
#pragma once

#include "pipeline/contract/types.h"

namespace mbtfm::network {

/// The polyline with fewer points, nowhere further than `tolerance_um` from it (Douglas & Peucker 1973).
Polyline simplified(const Polyline& points_um, double tolerance_um);

/// The polyline without the inner points that make a piece shorter than `shortest_um`; its ends stay.
Polyline without_short_pieces(Polyline points_um, double shortest_um);

/// The polyline with points added so that no piece is longer than `longest_um`.
Polyline densified(const Polyline& points_um, double longest_um);

}  // namespace mbtfm::network
