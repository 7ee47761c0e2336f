/// Where a scene lies on the surface: what the block of a finite element model has to cover.
#pragma once

#include <cstdint>

#include "pipeline/contract/extent.h"
#include "substrate/ellipse.h"

namespace mbtfm::substrate {

using mbtfm::Extent;

/// The smallest axis-parallel rectangle around points and ellipses. @throws InvalidData where there are none
Extent extent_of(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses);

/// @throws NotSolved where squares of side `step_um` over the scene are more than the elements that memory takes
void check_size(const Extent& scene, double step_um, std::int64_t most_elements);

}  // namespace mbtfm::substrate
