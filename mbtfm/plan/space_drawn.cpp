#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "mbtfm/plan/space_grid.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::plan {

using Eigen::Index;
using Eigen::Vector3d;

namespace {

std::vector<Index> random_part(std::size_t n_all, std::size_t n, drawing::Random& random) {
  std::vector<Index> order(n_all);
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t i = 0; i < n; ++i)
    std::swap(order[i], order[i + static_cast<std::size_t>(random.below(static_cast<int>(n_all - i)))]);
  order.resize(n);
  std::ranges::sort(order);
  return order;
}

std::vector<spatial::PartForce> found_in(const SpaceScene& scene, const spatial::Problem& problem) {
  tractions::TractionParameters traction = scene.traction;
  traction.method = tractions::TractionMethod::tikhonov;  // the forces of adhesions of group-l1 are those of it
  spatial::SpatialInputs inputs{{}, scene.gel, {}, scene.outline_um};
  for (const SpacePatch& patch : scene.patches) inputs.adhesions.push_back(patch.adhesion);
  return spatial::reconstruct(problem, inputs, traction, scene.spatial, 1).forces;
}

void add_components(std::vector<DrawnNumber>& all, int experiment, const SpacePatch& patch, const Vec3& found_nN,
                    const Eigen::Matrix3d& covariance_nN2, const Eigen::Matrix3d& directions) {
  const Vector3d along = directions.col(1), normal = directions.col(2);
  const std::pair<SpaceComponent, Vector3d> components[] = {{SpaceComponent::tangential, along},
                                                            {SpaceComponent::normal, normal},
                                                            {SpaceComponent::across, normal.cross(along)}};
  const Vector3d truth(patch.force_nN.x, patch.force_nN.y, patch.force_nN.z), found(found_nN.x, found_nN.y, found_nN.z);
  for (const auto& [component, e] : components)
    all.push_back({.experiment = experiment,
                   .id = patch.adhesion.adhesion_id,
                   .component = component,
                   .true_nN = e.dot(truth),
                   .found_nN = e.dot(found),
                   .predicted_error_nN = std::sqrt(e.dot(covariance_nN2 * e))});
}

}  // namespace

Drawn draw_experiments(const SpaceScene& scene, const SpacePool& pool, const SpaceForeseen& foreseen,
                       const Point& point, int n_experiments, const Work& work) {
  Drawn drawn{.point = point, .n_experiments = n_experiments};
  work.tell(0.8, "drawing experiments");
  std::vector<std::vector<spatial::PartForce>> found(static_cast<std::size_t>(n_experiments));
  numerics::parallel_for(n_experiments, work.threads, [&](int k) {
    constexpr std::uint64_t kFirst = 100;  // far from the stream of the pool
    drawing::Random places(scene.seed, drawing::Stream::beads, kFirst + static_cast<std::uint64_t>(k)),
        noise(scene.seed, drawing::Stream::noise, kFirst + static_cast<std::uint64_t>(k));
    const std::vector<Index> chosen = random_part(pool.beads.size(), n_beads_of(scene, point.density), places);
    // a stiffer gel is more noise
    const double over_stated = point.noise_um * point.youngs_modulus_kPa / scene.gel.youngs_modulus_kPa;
    found[k] = found_in(scene, part_of(scene, pool, chosen, over_stated, &noise));
  });
  for (std::size_t k = 0; k < found.size(); ++k) {
    for (std::size_t a = 0; a < scene.patches.size(); ++a) {
      const auto at = 3 * static_cast<Index>(a);
      add_components(drawn.numbers, static_cast<int>(k) + 1, scene.patches[a], found[k][a].force_nN,
                     foreseen.of(point).covariance_nN2.block<3, 3>(at, at), patch_directions(scene, scene.patches[a]));
    }
  }
  sum_up(drawn);
  return drawn;
}

}  // namespace mbtfm::plan
