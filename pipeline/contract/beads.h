/// Where the gel went.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm {

/// The bead picture together with which the cell's pictures were taken, before the stage moved again. Its frame is that
/// of all places: adhesions, fibres, outline, and beads at rest.
enum class CellWith {
  stressed,  ///< of a time series the first
  relaxed,
  each  ///< of a time series: the cell's pictures of each frame are with its own beads
};
constexpr auto words(CellWith) { return std::array{"stressed", "relaxed", "each"}; }

/// Displacement (stressed minus relaxed position) of one bead.
struct Bead {
  Vec2 position_um;  ///< at rest, in the frame of the cell's pictures
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
