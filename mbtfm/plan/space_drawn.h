/// Experiments in space, drawn to check what the plan says of them.
#pragma once

#include <vector>

#include "mbtfm/plan/space_grid.h"

namespace mbtfm::plan {

/// As its force goes along the surface, out of the surface, and square to both.
enum class SpaceComponent { tangential, normal, across };
constexpr auto words(SpaceComponent) { return std::array{"along the surface", "normal", "across"}; }

/// One component of a patch's force in one experiment.
struct SpaceDrawnForce {
  int experiment = 0, adhesion_id = 0;
  SpaceComponent component = SpaceComponent::tangential;
  double true_nN = 0, found_nN = 0;
  double predicted_error_nN = 0;  ///< by the plan
};

struct SpaceDrawn {
  SpacePoint point;
  std::vector<SpaceDrawnForce> forces;
  int n_experiments = 0;
  double error_over_predicted = 0;  ///< root mean square over the components
  double by_chance = 0;             ///< standard deviation that it would have by chance, were it 1
};

/// Other beads of the pool, with noise; reconstructed as a cell is.
SpaceDrawn draw_experiments(const SpaceScene& scene, const SpacePool& pool, const SpaceForeseen& foreseen,
                            const SpacePoint& point, int n_experiments, const Work& work);

}  // namespace mbtfm::plan
