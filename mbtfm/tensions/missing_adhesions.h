/// Forces where no adhesion was found: what a dim adhesion image hides, the beads may still show.
#pragma once

#include <vector>

#include "mbtfm/tensions/linear_data.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/gel.h"
#include "pipeline/contract/results.h"

namespace mbtfm::tensions {

struct EnsembleFit;
struct MotionsBeside;

/// Whether it lies in the cell, and an adhesion there is none of those that were found.
bool is_free(const Cell& cell, Vec2 place_um);

/// The best ones, each with those before: places one micrometre apart, of a force spread over a disc of 0.5 um. They
/// are looked for in what the forces leave of the beads around, and asked by all beads (search.h). Kept are those that
/// the beads make likelier than not: one place in ten cells is expected, of a force as the adhesions have.
std::vector<MissingAdhesion> missing_adhesions(const EnsembleFit& fit, const Cell& cell, const Gel& gel, int threads);

/// None of the adhesions was seen: they represent forces at unknown places.
bool are_assumed(const std::vector<Adhesion>& adhesions);

/// The adhesions' forces again, with these displacements of the beads, of any sizes; the tensions stay.
/// @param shapes  2·beads × some
/// @param n_last  motions of the data that stay the last ones
/// @returns the sizes
MotionsBeside find_forces_beside(EnsembleFit& fit, MatrixXd shapes, Index n_last);

/// The fit of a cell that pulls at these places, too: the adhesions' forces with theirs, and the total with them.
/// @param places  their forces and gains become what the fit finds
/// @param n_last  motions of the data that stay the last ones
EnsembleFit with_their_forces(EnsembleFit fit, std::vector<MissingAdhesion>& places, const Gel& gel, Index n_last);

/// The cell with adhesions at these places, too: a fibre that no adhesion holds is held by the one that it ends on.
Cell held_at(Cell cell, const std::vector<MissingAdhesion>& places);
/// Those that held_at() has added, with these forces (fx, fy by adhesion), and further ones: the largest gain first.
/// @param held  as they were added
std::vector<MissingAdhesion> with_forces_of(const Cell& cell, const VectorXd& forces_nN,
                                            std::vector<MissingAdhesion> held,
                                            const std::vector<MissingAdhesion>& further);

/// The total and its error with the forces of further adhesions, which are too weak to be found.
/// @param found  all that were missed, as they were found, whether they are adhesions of the cell by now or not
EnsembleFit with_unfound(EnsembleFit fit, const Cell& cell, const std::vector<MissingAdhesion>& found);

}  // namespace mbtfm::tensions
