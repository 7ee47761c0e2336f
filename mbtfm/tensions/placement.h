/// Where the cell lies on the beads. The camera sees them through other filters than the cell, or after the stage has
/// moved, so that both are off by some pixels. The cell is therefore a rigid body with three unknowns, a shift s and a
/// turn Q about its centre c, which are found with the tensions:
///
///   u(x) = Q G(Qᵀ (x − c − s)) F
///
/// The beads are taken into the cell's frame, where all results are. In a small rest of shift and turn u is linear.
/// That rest stays among the motions that the beads may have besides (linear_data.h), so that the error bars hold what
/// the beads do not know of the cell's place.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/linear_data.h"
#include "mbtfm/tensions/tension_fit.h"
#include "network/contractile.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/effects.h"
#include "pipeline/contract/gel.h"

namespace mbtfm::tensions {

/// From the cell's frame to that of the beads: a turn about the centre, then a shift.
struct Placement {
  Vec2 centre_um, shift_um;
  double turn_rad = 0;  ///< from +x towards +y
  Vec2 turned(Vec2 vector) const;
  Vec2 of(Vec2 place_um) const;
};
/// Beads, and how they move, as the cell sees them.
DisplacementField in_cell_frame(DisplacementField beads, const Placement& placement);
/// Displacements of the cell's frame at these beads.
DisplacementField in_bead_frame(DisplacementField fitted, const DisplacementField& beads, const Placement& placement);

/// Displacement of the beads per shift of the cell along x and y (um/um) and per turn about the centre (um/rad), forces
/// and all: 2·beads × 3. By the half-space's field, beyond four semi-axes that of a point force: the base and the sides
/// of a gel change little so near to an adhesion that its place matters.
/// @param model_um  displacement of the beads by these forces, 2·beads
MatrixXd placement_motions(const Gel& gel, const std::vector<substrate::Ellipse>& ellipses, const VectorXd& forces_nN,
                           const std::vector<Vec2>& beads_um, const VectorXd& model_um, Vec2 centre_um, int threads);

/// By how much the displacement by these forces changes where each bead goes `by_um` (2·beads). By the half-space's
/// field, as above.
VectorXd carried_um(const Gel& gel, const std::vector<substrate::Ellipse>& ellipses, const VectorXd& forces_nN,
                    const std::vector<Vec2>& beads_um, const VectorXd& by_um, int threads);

/// The beads may move by a shift and a turn of the cell besides: the error bars then hold what they do not know of
/// them.
LinearData with_place(LinearData data, const Cell& cell, const Gel& gel, const VectorXd& forces_nN, Vec2 centre_um,
                      int threads);

/// A cell where the beads want it.
struct PlacedCell {
  Placement placement;
  LinearData data;  ///< of the beads in the cell's frame, what is left of shift and turn among its motions
  Trial start;      ///< of the network there
  Effect effect;    ///< off: the cell is where it was
};

/// The data of these beads.
using DataOf = std::function<LinearData(const DisplacementField&)>;

/// Gauss–Newton over shift and turn on one network, tensions fitted at each place, until what is left is linear.
///
/// auto: off if the beads determine the shift to worse than half the adhesions' mean semi-minor axis, within which
/// the field is linear in it, or if no place is found within kFarthest.
/// @param data  of the beads as they are
/// @param start  a trial with these data
PlacedCell place_cell(const Cell& cell, const network::Contractile& network, const DisplacementField& beads,
                      LinearData data, const DataOf& data_of, const Gel& gel, const FitParameters& parameters,
                      const Trial& start, Switch setting, int threads);

/// What came of it besides the fit: shift x, y (um) and turn (rad) with standard errors.
struct FoundPlacement {
  Placement placement;
  Eigen::Vector3d sigma;
};
/// @param motions  the last three those of placement_motions()
FoundPlacement placement_among(const MotionsBeside& motions, Placement placement);
/// Of fit.json.
Figures figures_of(const FoundPlacement& found);
/// "(0.31, -0.12) +- (0.02, 0.02) um, turned by 0.1 +- 0.2 degrees"
std::string sentence_of(const FoundPlacement& found);

// Where the beads lie while the cell pulls. The cell's images show its adhesions under its own pull, and tracking
// gives the beads' places at rest. Over an adhesion the gel moves by as much as both are apart, a micrometre and more.
// The gel's field depends on the way from an adhesion to a bead, so that both must be taken in one state:
//
//   u = G(x + u − a) F,   x: bead at rest, a: adhesion as seen
//
// With both at rest instead it would be G(x − a + u(a)) F; the two differ by the gel's strain times the field, which
// linear elasticity leaves out anyway.

/// Each bead where it lies under load.
DisplacementField under_load(DisplacementField beads);

/// The beads in the state that explains them better, and their data.
struct BeadsOfState {
  DisplacementField beads;
  LinearData data;
  Effect effect;
};

/// Of data of beads at rest: by how much more the beads would move under load, by the forces that explain them at rest.
using Carried = std::function<VectorXd(const LinearData&)>;

/// auto: under load where the beads say so. No cell model is asked: forces of the adhesions, all independent, leave the
/// squares S of the beads, and n ln(S_rest/S_load) is twice the logarithm of the odds, as both states have the same
/// unknowns. If `carried` shows that the odds are hopeless, the data under load are not asked for. Fields of other
/// programs may state the places under load already, and simulated cells are made at rest.
///
/// Source: Kass & Raftery, J Am Stat Assoc 90:773, 1995: above 10 the evidence is very strong.
/// @param data  of the beads at rest
/// @param size_um  of an adhesion; where no bead moves by `tolerance` of it, both states are the same
BeadsOfState take_state(const DisplacementField& at_rest, LinearData data,
                        const std::function<LinearData(const DisplacementField&)>& data_of, double size_um,
                        double tolerance, Switch setting, const Carried& carried = {});

}  // namespace mbtfm::tensions
