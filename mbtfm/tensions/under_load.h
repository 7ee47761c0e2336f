/// Where the beads lie while the cell pulls. The cell's images show its adhesions under its own pull, and tracking
/// gives the beads' places at rest. Over an adhesion the gel moves by as much as both are apart, a micrometre and more.
/// The gel's field depends on the way from an adhesion to a bead, so that both must be taken in one state:
///
///   u = G(x + u − a) F,   x: bead at rest, a: adhesion as seen
///
/// With both at rest instead it would be G(x − a + u(a)) F; the two differ by the gel's strain times the field, which
/// linear elasticity leaves out anyway.
#pragma once

#include <functional>
#include <string>

#include "mbtfm/tensions/linear_data.h"
#include "pipeline/contract/effects.h"

namespace mbtfm::tensions {

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
/// unknowns. Where `carried` tells that the odds are hopeless, the data under load are not asked for. Fields of other
/// programs may state the places under load already, and simulated cells are made at rest.
///
/// Source: Kass & Raftery, J Am Stat Assoc 90:773, 1995: above 10 the evidence is very strong.
/// @param data  of the beads at rest
/// @param size_um  of an adhesion; where no bead moves by `tolerance` of it, both states are the same
BeadsOfState take_state(const DisplacementField& at_rest, LinearData data,
                        const std::function<LinearData(const DisplacementField&)>& data_of, double size_um,
                        double tolerance, Switch setting, const Carried& carried = {});

}  // namespace mbtfm::tensions
