#include "pipeline/contract/beads.h"

#include <algorithm>
#include <cmath>

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

}  // namespace mbtfm
