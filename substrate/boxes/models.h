/// The models of finite elements.
#pragma once

#include "substrate/models.h"

namespace mbtfm::boxes {

inline constexpr substrate::Capabilities kSplitCan{.base = true, .sides = true, .normal_displacement = true};
inline constexpr substrate::Capabilities kRefinedCan{
    .base = true, .sides = true, .grading = true, .inside = true, .normal_displacement = true};

substrate::Model split();
substrate::Model refined();

}  // namespace mbtfm::boxes
