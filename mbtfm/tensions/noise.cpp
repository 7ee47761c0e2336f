#include "mbtfm/tensions/noise.h"

#include <algorithm>
#include <cmath>

#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::tensions {

NoiseLevel noise_level(const DisplacementField& beads, const LinearData& data, const Eigen::VectorXd& forces_nN,
                       const Polygon& outline_um, double far_distance_um) {
  constexpr std::size_t kFewest = 30;  // of beads: 60 components tell a standard deviation to about 10 %
  const Eigen::VectorXd residual = residual_um(data, forces_nN);
  std::vector<double> far, all;
  for (std::size_t i = 0; i < beads.size(); ++i) {
    const auto row = 2 * static_cast<Eigen::Index>(i);
    const bool is_far = !contains(outline_um, beads[i].position_um) &&
                        distance_to_boundary_um(outline_um, beads[i].position_um) >= far_distance_um;
    for (const double r : {residual[row], residual[row + 1]}) {
      all.push_back(std::abs(r));
      if (is_far) far.push_back(std::abs(r));
    }
  }
  const bool has_far = far.size() >= 2 * kFewest;
  std::vector<double>& used = has_far ? far : all;
  if (used.empty()) return {};
  const std::string source = std::to_string(used.size() / 2) +
                             (has_far ? " beads far from the cell" : " beads, too few of them far from the cell");
  return {.sigma_um = 1.4826 * numerics::median_in(used), .source = source};
}

}  // namespace mbtfm::tensions
