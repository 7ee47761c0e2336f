#pragma once

#include <optional>

#include "pipeline/contract/figures.h"
#include "pipeline/contract/results.h"

namespace mbtfm {

/// What the fit found for the cell as a whole: fit.json.
struct FitSummary {
  double relative_l2 = 0;           ///< |u_measured − u_model| / |u_measured|
  double expected_relative_l2 = 0;  ///< what the bead noise alone would give
  double noise_um = 0;              ///< standard deviation of a displacement component far from the cell
  double total_force_nN = 0;        ///< sum of force magnitudes over adhesions
  double network_force_nN = 0;      ///< the same with every fibre at the network's tension
  double fibre_force_nN = 0;        ///< the difference
  double network_surface_tension_nN_per_um = 0;
  int n_meshes = 1;
  int iterations = 0;
  bool converged = false;
  std::optional<ErrorBudget> error_budget;
  Figures more;  ///< further figures, written after the named ones
};

}  // namespace mbtfm
