#include "mbtfm/tensions/noise.h"

#include <algorithm>
#include <cmath>

#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::tensions {

namespace {

bool is_far(Vec2 bead_um, const Polygon& outline_um, double far_distance_um) {
  return !contains(outline_um, bead_um) && distance_to_boundary_um(outline_um, bead_um) >= far_distance_um;
}

/// What lies beside another cell is no witness of rest.
bool is_used(const LinearData& data, std::size_t bead) { return data.weight_per_um[2 * static_cast<Index>(bead)] > 0; }

}  // namespace

bool has_far_beads(const LinearData& data, const Polygon& outline_um, double far_distance_um) {
  constexpr int kFewest = 30;
  int n = 0;
  for (std::size_t b = 0; b < data.position_um.size(); ++b)
    n += is_used(data, b) && is_far(data.position_um[b], outline_um, far_distance_um);
  return n >= kFewest;
}

NoiseLevel noise_level(const DisplacementField& beads, const LinearData& data, const VectorXd& forces_nN,
                       const Polygon& outline_um, double far_distance_um) {
  const VectorXd residual = residual_um(data, forces_nN);
  const bool has_far = has_far_beads(data, outline_um, far_distance_um);
  std::vector<double> used;
  for (std::size_t i = 0; i < beads.size(); ++i) {
    if (!is_used(data, i)) continue;
    if (has_far && !is_far(beads[i].position_um, outline_um, far_distance_um)) continue;
    const auto row = 2 * static_cast<Index>(i);
    for (const double r : {residual[row], residual[row + 1]}) used.push_back(std::abs(r));
  }
  if (used.empty()) return {};
  const std::string source = std::to_string(used.size() / 2) +
                             (has_far ? " beads far from the cell" : " beads, too few of them far from the cell");
  return {.sigma_um = 1.4826 * numerics::median_in(used), .source = source};
}

}  // namespace mbtfm::tensions
