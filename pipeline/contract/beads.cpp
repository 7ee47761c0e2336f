#include "pipeline/contract/beads.h"

#include <algorithm>

#include "pipeline/contract/extent.h"

namespace mbtfm {

std::vector<Vec2> points_of(const DisplacementField& beads) {
  std::vector<Vec2> points_um;
  for (const Bead& b : beads) points_um.push_back(b.position_um);
  return points_um;
}

bool state_errors(const DisplacementField& beads) {
  return std::ranges::all_of(beads, [](const Bead& b) { return b.sigma_um > 0; });
}

double beads_per_um2(const DisplacementField& beads) {
  const double area_um2 = extent_of(beads, &Bead::position_um).area_um2();
  return area_um2 > 0 ? static_cast<double>(beads.size()) / area_um2 : 0;
}

}  // namespace mbtfm
