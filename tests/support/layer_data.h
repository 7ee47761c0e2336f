/// The data of beads about a cell's adhesions on a layer, as mbtfm-fit reduces them.
#pragma once

#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tensions/linear_data.h"
#include "substrate/greens/models.h"

namespace mbtfm::test {

/// With the common motions of all beads allowed for.
inline tensions::LinearData data_on_layer(const DisplacementField& beads, const Cell& cell, const Gel& gel) {
  const auto greens = greens::make_greens(gel, {.model = substrate::ModelKind::layer}, 1);
  const Eigen::MatrixXd compliance =
      greens->compliance_um_per_nN(points_of(beads), substrate::ellipses_of(cell.adhesions));
  return tensions::reduce(beads, substrate::dense_response(compliance), {}, 1, tensions::affine_motions(beads));
}

}  // namespace mbtfm::test
