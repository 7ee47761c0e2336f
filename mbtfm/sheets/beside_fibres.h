/// An evenly contracting sheet as one more model of a cell that was fitted with fibres: does the scene call for these?
#pragma once

#include <optional>
#include <vector>

#include "mbtfm/tensions/model_checks.h"
#include "pipeline/contract/gel.h"
#include "substrate/compliance.h"

namespace mbtfm::sheets {

/// Contraction and stiffness of a sheet that is bonded to the gel over the whole cell, fitted to the beads as the
/// cell's fit has them: with its weights, and with the motions that it allows for. Triangles are coarse, an eighth of
/// the cell's half width at its edge: displacements change by some per cent with finer ones, far less than models
/// differ. None where the gel is one of finite elements, which answer for each triangle with a solve, where it is not
/// linear, or where no triangles follow the outline.
/// @param outline_um  of the cell, then its holes
std::optional<tensions::ModelScore> score_of_sheet(const tensions::LinearData& data,
                                                   const std::vector<Polygon>& outline_um, const Gel& gel,
                                                   const substrate::Substrate& model, int threads);

}  // namespace mbtfm::sheets
