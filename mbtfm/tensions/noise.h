/// The noise of the bead displacements, from beads far from the cell (thesis 3.3).
#pragma once

#include <string>

#include "mbtfm/tensions/linear_data.h"

namespace mbtfm::tensions {

/// At least 30 of those in use lie that far outside the outline: 60 components tell a standard deviation to about 10 %.
bool has_far_beads(const LinearData& data, const Polygon& outline_um, double far_distance_um);

struct NoiseLevel {
  double sigma_um = 0;  ///< standard deviation of a component
  std::string source;
};

/// From what the model leaves unexplained at beads further than `far_distance_um` outside the outline: 1.4826 × the
/// median magnitude of a component, which outliers do not move. Without far beads: of all beads.
NoiseLevel noise_level(const DisplacementField& beads, const LinearData& data, const VectorXd& forces_nN,
                       const Polygon& outline_um, double far_distance_um);

}  // namespace mbtfm::tensions
