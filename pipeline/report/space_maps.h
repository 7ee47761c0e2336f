/// Maps of a cell whose beads are in space: seen from above, x to the right and y down.
#pragma once

#include <vector>

#include <optional>

#include "pipeline/report/colours.h"
#include "pipeline/report/maps.h"
#include "pipeline/report/space_results.h"

namespace mbtfm::report {

/// Tractions along the normal: out of the gel red, into it blue, nothing white.
Figure normal_map(const SpaceResults& results);
/// Along the surface, with arrows of its part in x and y.
Figure tangential_map(const SpaceResults& results);
/// Standard error of the traction, root mean square of the three components; none where it is not known.
std::optional<Figure> error_map(const SpaceResults& results);
/// How far apart two forces must be; none where it is not known.
std::optional<Figure> resolution_map(const SpaceResults& results);
/// Beads near a vertical plane through the strongest traction, along x and along y, with their displacement.
std::vector<Figure> bead_slices(const SpaceResults& results);

/// Of the tractions' sizes.
ColourScale traction_colours(const SpaceResults& results);

}  // namespace mbtfm::report
