/// Where the gel went.
#pragma once

#include <string>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm {

/// Displacement (stressed minus relaxed position) of one bead.
struct Bead {
  Vec2 position_um;  ///< in the relaxed state
  Vec2 displacement_um;
  double sigma_um = 0;  ///< standard error of each component
  std::string flag;     ///< why it must not be used; empty: good
};
using DisplacementField = std::vector<Bead>;
std::vector<Vec2> points_of(const DisplacementField& beads);
/// Each of them a standard error.
bool state_errors(const DisplacementField& beads);
/// Over the rectangle that holds them; 0 where they spread over no area.
double beads_per_um2(const DisplacementField& beads);

/// State what must hold of a value. @throws InvalidData naming the element and the finding.
void check(const DisplacementField& field);

}  // namespace mbtfm
