/// Displacements by a few hundred loads, regularised: for point forces and boundary elements.
#pragma once

#include <functional>
#include <optional>
#include <vector>

#include "mbtfm/inverse/spectrum.h"
#include "pipeline/contract/beads.h"

namespace mbtfm::tractions {

/// Columns 2j, 2j+1: displacement (um) by load j along x, y; rows 2i, 2i+1: at point i.
using Compliance = std::function<MatrixXd(const std::vector<Vec2>& points_um)>;

/// |G f − u|² + lambda² |f|², each bead weighted by its 1/sigma², of mean one.
class DenseProblem {
 public:
  /// @param truth  of the `n_true` loads that may really be there: see response_to_truth()
  /// @throws InvalidData where there are fewer displacement components than loads
  DenseProblem(const DisplacementField& beads, const Compliance& compliance, Index n_loads, const Compliance& truth,
               Index n_true);

  inverse::LambdaScan scan() const { return spectrum_->scan(stated_variance_, inverse::SignalIn::felt); }
  const inverse::Spectrum& spectrum() const { return *spectrum_; }
  /// What solve(lambda) makes of each true load of one, without noise.
  MatrixXd response_to_truth(double lambda) const;

 private:
  std::optional<double> stated_variance_;
  std::optional<inverse::Spectrum> spectrum_;
  MatrixXd projected_truth_;  ///< Gᵀ times the truth's displacements, in the spectrum's frame
};

}  // namespace mbtfm::tractions
