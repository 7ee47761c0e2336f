/// Experiments drawn to check what the plan says of them.
#pragma once

#include <string>
#include <vector>

#include "mbtfm/plan/grid.h"

namespace mbtfm::plan {

/// One fibre in one experiment.
struct DrawnTension {
  int experiment = 0, fibre_id = 0;
  double true_nN = 0, found_nN = 0;
  double predicted_error_nN = 0;  ///< by the plan
  double stated_error_nN = 0;     ///< by the fit itself
};

struct Drawn {
  Point point;
  std::vector<DrawnTension> tensions;
  int n_experiments = 0;
  double error_over_predicted = 0;   ///< root mean square over the tensions
  double stated_over_predicted = 0;  ///< median
  double by_chance = 0;              ///< standard deviation that the first would have by chance, were it 1
};

/// Beads at other places, with noise, fitted as a cell is: meshes that are not the cell's own, no tension known.
Drawn draw_experiments(const Scene& scene, const Computed& computed, const Point& point, int n_experiments,
                       const tensions::Work& work);

}  // namespace mbtfm::plan
