/// An evenly contracting sheet, without the fibres and with them, as further models of a cell that was fitted with
/// fibres in a network: does the scene call for these?
#pragma once

#include <vector>

#include "mbtfm/tensions/model_checks.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/gel.h"
#include "substrate/compliance.h"

namespace mbtfm::sheets {

/// Contraction and stiffness of a sheet that is bonded to the gel over the whole cell, fitted to the beads as the
/// cell's fit has them: with its weights, and with the motions that it allows for ("sheet"); the same with a tension of
/// zero or more in each fibre ("sheet-with-bundles"). Triangles are coarse, an eighth of the cell's half width at its
/// edge: displacements change by some per cent with finer ones, far less than models differ. None where the gel is one
/// of finite elements, which answer for each triangle with a solve, where it is not linear, or where no triangles
/// follow the outline.
/// @param cell  its outline, holes and fibres; of fibres that leave the outline on their way there is nothing
std::vector<tensions::ModelScore> scores_of_sheets(const tensions::LinearData& data, const Cell& cell, const Gel& gel,
                                                   const substrate::Substrate& model, int threads);

}  // namespace mbtfm::sheets
