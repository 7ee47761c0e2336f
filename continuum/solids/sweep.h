/// Which cases a user asks for.
#pragma once

#include <string>
#include <vector>

#include "continuum/solids/indent.h"

namespace mbtfm::solids {

/// Reads "5.3..15.8:11" (that many from the first to the last) or "0.1, 0.5, 1": numbers above zero, or not below it.
/// @param name  of what they are, for messages
/// @throws UsageError where it is no such list
enum class Zero { is_allowed, is_refused };
std::vector<double> values_in(const std::string& text, const std::string& name, Zero zero);

/// Reads "height_um=5.3..15.8:11 modulus_ratio=0.1,0.5,1": every height with every ratio; what is not named stays.
/// @throws UsageError
std::vector<Case> cases_of(const std::string& sweep, const Case& otherwise);

}  // namespace mbtfm::solids
