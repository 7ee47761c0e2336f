#include "pipeline/contract/beads.h"

#include <cmath>

#include "pipeline/contract/beads_in_space.h"
#include "pipeline/contract/errors.h"
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

void check(const std::vector<BeadInSpace>& beads) {
  for (std::size_t i = 0; i < beads.size(); ++i) {
    const BeadInSpace& b = beads[i];
    const bool has_errors = b.sigma_um >= 0 && b.sigma_z_um >= 0 && std::isfinite(b.sigma_um + b.sigma_z_um);
    if (is_finite(b.position_um) && is_finite(b.displacement_um) && has_errors) continue;
    throw InvalidData("bead " + std::to_string(i), "finite numbers, standard errors not below 0", "others");
  }
}

}  // namespace mbtfm
