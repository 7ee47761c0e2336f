/// Displacements as the answer to a few hundred loads, regularised: for point forces and boundary elements.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>

#include "mbtfm/tractions/regularisation.h"
#include "mbtfm/tractions/spectrum.h"
#include "pipeline/contract/beads.h"
#include "pipeline/contract/geometry.h"
#include "pipeline/contract/range.h"

namespace mbtfm::tractions {

/// Columns 2j, 2j+1: displacement (um) by load j along x, y; rows 2i, 2i+1: at point i.
using Compliance = std::function<Eigen::MatrixXd(const std::vector<Vec2>& points_um)>;

/// |G f − u|² + lambda² |f|², each bead weighted by its 1/sigma², of mean one.
class DenseProblem {
 public:
  /// @param truth  answers to the `n_true` loads that may really be there: what they do is asked of response_to_truth()
  /// @throws InvalidData where there are fewer displacement components than loads
  DenseProblem(const DisplacementField& beads, Compliance compliance, Eigen::Index n_loads, const Compliance& truth,
               Eigen::Index n_true);

  LambdaScan scan() const { return spectrum_->scan(stated_variance_, SignalIn::felt); }
  const Spectrum& spectrum() const { return *spectrum_; }
  /// What solve(lambda) makes of each true load of one, without noise.
  Eigen::MatrixXd response_to_truth(double lambda) const;

 private:
  template <class Use>
  void for_blocks(const Use& use) const;  ///< use(range of beads, weighted block of G, weighted u of the same rows)
  struct Range;
  Eigen::MatrixXd weighted(const Compliance& compliance, const Range& range) const;
  const DisplacementField& beads_;
  Compliance compliance_;
  std::vector<double> weights_;
  std::optional<double> stated_variance_;
  std::optional<Spectrum> spectrum_;
  Eigen::MatrixXd projected_truth_;  ///< of the truth's answers, in the spectrum's frame
};

}  // namespace mbtfm::tractions
