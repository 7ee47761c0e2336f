/// The Cramér–Rao bound: how exactly beads can tell tensions and forces.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mbtfm/plan/scene.h"
#include "pipeline/contract/work.h"
#include "samples/drawing/random.h"

namespace mbtfm::plan {

struct KnownCell;

/// Standard errors by the beads' noise alone, for a noise of 1 um on a gel of 1 kPa:
///
///   Cov = (Dᵀ Gᵀ P G D)⁻¹,   D = dR/dt, G the gel's compliance, P what the beads do besides taken off
///
/// of the tensions. G falls with the modulus and nothing else depends on it, so all of them grow with noise times
/// modulus. The beads' squares add up, so the covariance falls with their number, but for which places they happen to
/// have. Source: Rao, Linear Statistical Inference (1973), 5a. Of the best unbiased estimate: bounds t >= 0 can only
/// lower the scatter.
struct Precision {
  Eigen::VectorXd tensions;         ///< nN/(um kPa), by label
  double total_force = 0;           ///< of the sum of the adhesions' forces, from the tensions
  Eigen::VectorXd adhesion_forces;  ///< by adhesion, along its force, from the tensions
  Eigen::VectorXd free_forces;      ///< the same of forces independent of each other, as `adhesion-forces` finds them
};

/// At places that beads may have.
struct BeadsOnGel {
  std::vector<Vec2> places_um;
  substrate::SharedResponse response;  ///< of a gel of `modulus_kPa`
  double modulus_kPa = 0;
};
/// @throws UsageError where so many beads do not fit
BeadsOnGel beads_on_gel(const Scene& scene, const KnownCell& cell, double beads_per_um2, std::uint64_t draw,
                        int threads);
/// A random part of them. @param share  0 … 1
BeadsOnGel some_of(const BeadsOnGel& beads, double share, drawing::Random& random);

Precision precision_of(const Scene& scene, const KnownCell& cell, const BeadsOnGel& beads, int threads);

/// At these densities: parts of the beads of several draws, root mean square over the draws, as one draw of beads is
/// not another.
/// @param beads_per_um2  ascending
struct Densities {
  std::vector<double> beads_per_um2;
  std::vector<Precision> precision;  ///< by density
};
Densities precision_at(const Scene& scene, const KnownCell& cell, const std::vector<double>& beads_per_um2,
                       const Work& work);

}  // namespace mbtfm::plan
