/// The smooth surface of a gel from the beads in its volume.
///
/// Beads of an even density n lie below z = s(x, y), z into the gel, their depths known to sigma. The negative log
/// likelihood, -n ∫ s dA - Σ log Phi((z - s)/sigma), bends s into the gel until beads hold it; the prior is that of a
/// thin plate, gamma/2 ∫ s_vv² + 2 r s_uv² + r² s_uu², u along the crests. Not the likeliest surface is found, which
/// hangs on the highest beads and lies too deep, but the mean of the Gauss distribution nearest to the posterior
/// (Opper, Archambeau, Neural Comput. 21 (2009) 786). gamma, r and the direction of the crests are those of the
/// greatest evidence (MacKay, Neural Comput. 4 (1992) 415).
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "pipeline/contract/geometry.h"
#include "substrate/surface/band.h"
#include "substrate/surface/splines.h"

namespace mbtfm::surface {

struct SurfaceFit {
  Lattice lattice;
  Eigen::VectorXd coefficients_um;
  std::shared_ptr<const Band> covariance_um2;  ///< of these, within the band
  Smoothing smoothing;
  double log_evidence = 0;
  double density_per_um3 = 0;      ///< of the beads
  std::vector<int> above_surface;  ///< beads more than four standard errors above it: they do not count

  double height_um(Vec2 at) const;
  double sigma_um(Vec2 at) const;  ///< standard error of the height
};

/// @param sigma_z_um  by bead, positive
/// @throws InvalidData where a number is not finite, beads are fewer than 30, in one plane or in sheets, or leave a
/// part of
///         the rectangle empty that they span, by place; NotSolved
SurfaceFit fit_beads(const std::vector<Vec3>& beads_um, const std::vector<double>& sigma_z_um);

}  // namespace mbtfm::surface
