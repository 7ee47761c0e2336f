/// The models of finite elements.
#pragma once

#include "substrate/models.h"

namespace mbtfm::elements {

inline constexpr substrate::Capabilities kSplitCan{.base = true, .sides = true, .normal_displacement = true};
inline constexpr substrate::Capabilities kRefinedCan{
    .base = true, .sides = true, .grading = true, .inside = true, .normal_displacement = true};
inline constexpr substrate::Capabilities kCurvedCan{.base = true,
                                                    .sides = true,
                                                    .inside = true,
                                                    .normal_displacement = true,
                                                    .space = true,
                                                    .surface = true,
                                                    .large_strain = true};

substrate::Model split();
substrate::Model refined();
substrate::Model curved_gel();

}  // namespace mbtfm::elements
