/// How far anything of a cell, its gel and its pictures can be away.
#pragma once

#include "pipeline/contract/range.h"

namespace mbtfm {

/// A metre: what lies beyond is damage, or in another unit, and powers of it would not be numbers.
inline constexpr double kFarthest_um = 1e6;

/// Of a coordinate, and of a displacement.
inline Range possible_place_um() { return Range::between(-kFarthest_um, kFarthest_um); }

}  // namespace mbtfm
