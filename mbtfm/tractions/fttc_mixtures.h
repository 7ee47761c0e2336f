/// FTTC of one field with any amount of noise, for the price of a few reconstructions.
#pragma once

#include <Eigen/Core>
#include <vector>

#include "mbtfm/tractions/traction.h"
#include "pipeline/contract/beads.h"
#include "pipeline/contract/gel.h"

namespace mbtfm::tractions {

/// Tractions are linear in the displacements but for lambda. So for each lambda of the scan the equation is solved for
/// the field, for the noise and for random signs; any mixture of field and noise has its criteria, its lambda and its
/// forces from these. Between the lambdas of the scan (three a decade) forces and residuals are those of a cubic
/// through four of them: of a single wave, whose share is 1 / (1 + lambda² / c²), that errs by 1.6 % at most.
class FttcMixtures {
 public:
  /// @param noise  at the beads of `field`, whose errors are one in both
  FttcMixtures(const DisplacementField& field, const DisplacementField& noise, const Gel& gel,
               const std::vector<Adhesion>& adhesions, const TractionParameters& parameters, int threads);
  /// Of field + factor · noise, its beads' errors being `factor`: 2·adhesions, as reconstruct_fttc finds them.
  Eigen::VectorXd forces_nN(double factor) const;

 private:
  struct AtLambda {
    double lambda = 0;
    Eigen::MatrixX2d residuals, forces_nN;  ///< of the field and of the noise
    Eigen::Matrix2d norms;                  ///< products of both tractions with both
    double degrees = 0, degrees_of_square = 0;
  };
  template <class Of>
  auto between(double lambda, const Of& of) const;
  std::vector<AtLambda> scan_;
  TractionParameters parameters_;
  double n_data_ = 0, unit_variance_ = 0;
};

}  // namespace mbtfm::tractions
