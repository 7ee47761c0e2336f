#include "pipeline/contract/beads.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/beads_in_space.h"
#include "pipeline/contract/errors.h"

namespace mbtfm {

double beads_per_um2(const DisplacementField& beads) {
  if (beads.empty()) return 0;
  Vec2 low = beads.front().position_um, high = low;
  for (const Bead& b : beads) {
    low = {std::min(low.x, b.position_um.x), std::min(low.y, b.position_um.y)};
    high = {std::max(high.x, b.position_um.x), std::max(high.y, b.position_um.y)};
  }
  const double area_um2 = (high.x - low.x) * (high.y - low.y);
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
