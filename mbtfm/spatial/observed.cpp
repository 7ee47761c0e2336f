#include "mbtfm/spatial/observed.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::spatial {
namespace {

/// Between neighbours: in a plane where they lie in a sheet thinner than that.
double distance_between_um(const std::vector<Vec3>& points, const std::vector<double>& depths) {
  const auto n = static_cast<double>(points.size());
  const double area = extent_of(points).area_um2();
  if (!(area > 0)) throw InvalidData("displacement", "beads spread over an area", "all of them on one line");
  const double deepest = numerics::quantile(depths, 0.95);
  const double in_plane = std::sqrt(area / n);
  return deepest < in_plane ? in_plane : std::cbrt(area * deepest / n);
}

}  // namespace

numerics::Near near_beads(const Observed& observed) {
  return {std::get<std::vector<Vec3>>(observed.at.points_um), observed.distance_um};
}

Observed observe(const std::vector<BeadInSpace>& beads, const Gel& gel, const Ground& ground,
                 const SpatialParameters& parameters) {
  check(beads);
  constexpr double kFewest = 4;       // a force, a couple and a noise are more than three vectors tell
  constexpr double kErrorsAbove = 3;  // of its height a bead may lie above the surface
  constexpr double kRounding_um = 0.02;
  Observed observed;
  std::vector<Vec3> points;
  std::vector<double> depths;
  std::vector<const BeadInSpace*> taken;
  for (const BeadInSpace& bead : beads) {
    Vec3 at = bead.position_um;
    if (!bead.flag.empty()) {
      ++observed.n_flagged;
      continue;
    }
    if (!ground.knows({at.x, at.y})) {
      ++observed.n_beyond;
      continue;
    }
    const double height = ground.height_um({at.x, at.y});
    const double sigma_z = bead.sigma_z_um > 0 ? bead.sigma_z_um : parameters.axial_sigma_ratio * bead.sigma_um;
    if (height - at.z > kErrorsAbove * sigma_z + kRounding_um) {
      ++observed.n_above;
      continue;
    }
    if (at.z > gel.thickness_um) {
      ++observed.n_below_base;
      continue;
    }
    at.z = std::max(at.z, height);
    points.push_back(at);
    depths.push_back(at.z - height);
    taken.push_back(&bead);
  }
  observed.n_beads = static_cast<int>(taken.size());
  if (observed.n_beads < kFewest) {
    throw InvalidData("displacement", "at least 4 beads in the gel that are not flagged",
                      std::to_string(observed.n_beads) + " of " + std::to_string(beads.size()) + " (" +
                          std::to_string(observed.n_flagged) + " flagged, " + std::to_string(observed.n_above) +
                          " above the surface, " + std::to_string(observed.n_below_base) + " below the base, " +
                          std::to_string(observed.n_beyond) + " where no surface is known)");
  }
  observed.distance_um = distance_between_um(points, depths);
  observed.depth_um = numerics::quantile(depths, 0.5);
  observed.at = {std::move(points), parameters.with_axial ? substrate::Components::all : substrate::Components::along};
  observed.states_errors = std::ranges::all_of(taken, [](const BeadInSpace* b) { return b->sigma_um > 0; });
  const Eigen::Index n = observed.n_components();
  observed.displacement_um.resize(n * observed.n_beads);
  observed.sigma_um.resize(n * observed.n_beads);
  for (Eigen::Index i = 0; i < observed.n_beads; ++i) {
    const BeadInSpace& bead = *taken[i];
    const double sigma = observed.states_errors ? bead.sigma_um : 1;
    const double sigma_z =
        observed.states_errors && bead.sigma_z_um > 0 ? bead.sigma_z_um : parameters.axial_sigma_ratio * sigma;
    const double u[] = {bead.displacement_um.x, bead.displacement_um.y, bead.displacement_um.z};
    const double s[] = {sigma, sigma, sigma_z};
    for (Eigen::Index c = 0; c < n; ++c) {
      observed.displacement_um[n * i + c] = u[c];
      observed.sigma_um[n * i + c] = s[c];
    }
  }
  return observed;
}

}  // namespace mbtfm::spatial
