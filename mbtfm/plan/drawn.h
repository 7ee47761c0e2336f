/// Experiments drawn to check what the plan says of them.
#pragma once

#include <vector>

#include "mbtfm/plan/experiment.h"
#include "mbtfm/plan/scene.h"
#include "pipeline/contract/work.h"

namespace mbtfm::plan {

struct Computed;

/// One fibre in one experiment.
struct DrawnTension {
  int experiment = 0, fibre_id = 0;
  double true_nN = 0, found_nN = 0;
  double predicted_error_nN = 0;  ///< by the plan
  double stated_error_nN = 0;     ///< by the fit itself, which knows nothing of the segmentation's errors
};

/// Errors of single adhesions' forces along their direction: 1.48 times the median magnitude, which is the standard
/// deviation of a normal variable.
struct ForceErrors {
  double with_network_nN = 0;  ///< forces of the tension fit
  double alone_nN = 0;         ///< forces independent of each other: adhesion-forces
  double fttc_nN = 0;          ///< tractions of FTTC summed up over each adhesion and 1.5 um around it
};

struct Drawn {
  Point point;
  std::vector<DrawnTension> tensions;
  ForceErrors forces;  ///< over all experiments
  int n_experiments = 0;
  double error_over_predicted = 0;  ///< root mean square over the tensions
  double by_chance = 0;             ///< standard deviation that it would have by chance, were it 1
};

/// Beads at other places, with noise; a segmentation with its errors; meshes that are not the cell's own. Fitted as a
/// cell is.
Drawn draw_experiments(const Scene& scene, const Computed& computed, const Point& point, int n_experiments,
                       const Work& work);

}  // namespace mbtfm::plan
