#include "mbtfm/tensions/solved_misfit.h"

#include <cmath>
#include <memory>
#include <mutex>

namespace mbtfm::tensions {

SolvedMisfit solved_misfit(const substrate::Substrate& substrate, std::vector<Vec2> points_um,
                           std::vector<substrate::Ellipse> ellipses, LinearData data) {
  data.reduced = {};  // not asked for, and large
  return [&substrate, data = std::move(data), points_um = std::move(points_um), ellipses = std::move(ellipses),
          one_at_a_time = std::make_shared<std::mutex>()](const VectorXd& forces) {
    std::vector<Vec2> forces_nN;
    for (Index i = 0; i < forces.size(); i += 2) forces_nN.push_back({forces[i], forces[i + 1]});
    const std::lock_guard lock(*one_at_a_time);
    const std::vector<Vec2> u_um = substrate.displacements_um(points_um, ellipses, forces_nN);
    VectorXd misfit_um = data.displacement_um;
    for (std::size_t i = 0; i < u_um.size(); ++i)
      misfit_um.segment<2>(2 * static_cast<Index>(i)) -= Eigen::Vector2d(u_um[i].x, u_um[i].y);
    return data.weight_per_um.cwiseProduct(less_motion(data, misfit_um)).squaredNorm();
  };
}

}  // namespace mbtfm::tensions
