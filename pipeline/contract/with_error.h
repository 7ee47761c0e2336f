/// A number and its standard error as text.
#pragma once

#include <string>

#include "pipeline/contract/geometry.h"

namespace mbtfm {

/// "2.35 +- 0.42": the error has two significant digits, the number ends where it does. Without a positive error both
/// as brief().
std::string with_error(double value, double error);
/// "(0.302, -0.25) +- (0.018, 0.20)"
std::string with_error(Vec2 value, Vec2 error);

}  // namespace mbtfm
