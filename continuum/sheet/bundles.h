/// Stress fibres in a sheet: cables of even tension from end to end.
#pragma once

#include <vector>

#include "continuum/sheet/sheet.h"
#include "pipeline/contract/geometry.h"

namespace mbtfm::sheet {

struct Bundle {
  int fibre_id = 0;
  Polyline points_um;
};

/// The bundles without what lies outside of the sheet at their ends. @throws InvalidData where nothing is left, or one
/// leaves the sheet between
std::vector<Bundle> within(const Elements& elements, const std::vector<Bundle>& bundles);

/// Forces on the nodes by a tension of 1 nN: f · v = −Σ t · (v(b) − v(a)) over the pieces from a to b, along t. Without
/// net force and torque.
NodeVectors forces_of_bundle_nN(const Elements& elements, const Bundle& bundle);

}  // namespace mbtfm::sheet
