/// The smooth surface through points that lie on it, with errors and strays.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "pipeline/contract/geometry.h"
#include "substrate/surface/band.h"
#include "substrate/surface/splines.h"

namespace mbtfm::surface {

/// Bicubic B-splines bent as a thin plate, its stiffness that of the greatest evidence (MacKay, Neural Comput. 4 (1992)
/// 415); errors are of Student's distribution with four degrees of freedom, so that strays pull little (Lange, Little,
/// Taylor, J. Am. Stat. Assoc. 84 (1989) 881).
struct PointFit {
  Lattice lattice;
  Eigen::VectorXd coefficients_um;
  std::shared_ptr<const Band> covariance_um2;  ///< within the band
  double error_scale = 1;   ///< standard errors over those given, at least 1; without any, the error itself (um)
  std::vector<int> strays;  ///< points more than five standard errors off

  double height_um(Vec2 at) const { return value_of(lattice, weights_at(lattice, at), coefficients_um); }
  double sigma_um(Vec2 at) const;  ///< standard error of the height
};

/// @param sigma_um  by point, positive; empty: alike and unknown
/// @throws InvalidData where a number is not finite, points are fewer than 16 or all on one line; NotSolved
PointFit fit_points(const std::vector<Vec3>& points_um, const std::vector<double>& sigma_um);

}  // namespace mbtfm::surface
