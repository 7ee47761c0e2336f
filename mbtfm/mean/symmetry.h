/// The motions that leave a shape as it is.
#pragma once

#include <string>
#include <vector>

#include "mbtfm/mean/registration.h"

namespace mbtfm::mean {

/// Schoenflies' symbol: C4 (turns by a quarter), C4v (mirrors, too), C1 (none), C1v (one mirror), Cinfv (a circle).
struct Symmetry {
  int n_turns = 1;
  bool has_mirrors = false;
  bool is_circle = false;
};
/// @throws UsageError where it is none of these
Symmetry symmetry_of(const std::string& text);

/// The motions of the group about the shape's centroid, the identity first; of a circle 72 turns. The mirrors' axes are
/// where the shape is nearest to its mirror image.
std::vector<Motion> motions_of(const Symmetry& symmetry, const Polygon& reference_um);

/// Root mean square distance of the shape from itself moved, the largest over the motions.
double asymmetry_um(const Polygon& reference_um, const std::vector<Motion>& motions);

/// Whether two ways to lay an outline onto the shape differ by a motion of the group.
bool are_equivalent(const Way& a, const Way& b, const std::vector<Motion>& motions);

}  // namespace mbtfm::mean
