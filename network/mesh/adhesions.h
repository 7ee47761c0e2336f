/// Adhesions as areas that the mesh holds.
#pragma once

#include <utility>
#include <vector>

#include "network/mesh/outline.h"
#include "network/mesh/size_field.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"

namespace mbtfm::mesh {

/// Adhesions at the same place moved apart, so that each can hold a vertex; and the labels of those moved.
/// @param distance  between centres, in wanted edge lengths
std::pair<std::vector<Adhesion>, std::vector<int>> separated(std::vector<Adhesion> adhesions, const SizeField& size,
                                                             double distance);

struct RimPart {
  Polyline points_um;
  bool is_closed = false;
};

/// Perimeter of the adhesion's ellipse.
double perimeter_um(const Adhesion& adhesion);

/// Points at even steps on the rim, which encloses the adhesion's area when it is drawn with edges of `edge_um`.
Polygon rim_um(const Adhesion& adhesion, double edge_um);

/// What of the rim bounds the area held by all adhesions: it lies inside the cell, and in no other adhesion. Where it
/// leaves the cell it ends on the boundary.
/// @param others  those near by
std::vector<RimPart> free_rim(const Adhesion& adhesion, const std::vector<Adhesion>& others, const Boundary& boundary,
                              double edge_um);

}  // namespace mbtfm::mesh
