/// How large forces are that are known with errors: noise makes every one longer.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm::tractions {

struct Magnitudes {
  Eigen::VectorXd expected_nN;     ///< by force
  Eigen::MatrixXd covariance_nN2;  ///< of the true magnitudes around these
};

/// Expected |F_a| for found forces F̂ = F + error, error ~ N(0, C), docs/theory/reconstructions.md (18). Before the
/// measurement each F_a is normal with a deviation s that is one of a list, from nothing to more than the largest
/// force; the shares of these are the most likely ones for all F̂ (Stephens, Biostatistics 18 (2017) 275). With them the
/// sum of the expected magnitudes is right in the mean, however many forces are no larger than their errors.
/// @param covariance_nN2  C, rows 2a and 2a + 1 of force a, positive definite
Magnitudes expected_magnitudes(const std::vector<Vec2>& forces_nN, const Eigen::MatrixXd& covariance_nN2);

}  // namespace mbtfm::tractions
