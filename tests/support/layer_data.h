/// The data of beads about a cell's adhesions on a layer, as mbtfm-fit reduces them.
#pragma once

#include "mbtfm/common_motion.h"
#include "mbtfm/fit_results.h"
#include "mbtfm/linear_data.h"
#include "substrate/compliance.h"

namespace mbtfm::test {

/// With the common motions of all beads allowed for.
inline inverse::LinearData data_on_layer(const DisplacementField& beads, const Cell& cell, const Gel& gel) {
  const auto greens = substrate::make_greens(gel, {.model = "layer"}, 1);
  const Eigen::MatrixXd compliance =
      greens->compliance_um_per_nN(inverse::points_of(beads), inverse::ellipses_of(cell));
  return inverse::reduce(beads, substrate::dense_response(compliance), {}, 1, inverse::affine_motions(beads));
}

}  // namespace mbtfm::test
