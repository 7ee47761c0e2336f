/// What a contraction that is not quite even changes of a sheet that is taken for one of even contraction.
#pragma once

#include <string>
#include <vector>

#include "continuum/sheet/forward.h"
#include "mbtfm/sheets/sheet_fit.h"

namespace mbtfm::sheets {

/// By so much of itself the contraction of a sheet may vary over it. Beads do not tell it: a sheet that pulls more at
/// its edge moves its gel as an even, softer one.
inline constexpr double kVariation = 0.2;

/// The smoothest patterns g: polynomials of second degree, orthogonal to each other and to 1. Two slopes, two saddles,
/// and the edge against the middle. Each has the root mean square kVariation/√3, with which the last is
/// kVariation (2 r²/R² − 1) on a disc.
/// @param weights  of the places: what area each stands for
/// @return places × 5
MatrixXd smooth_patterns(const std::vector<Vec2>& places_um, const VectorXd& weights);

/// How the places move (2·points × 5) if the contraction s becomes s (1 + g) of each pattern.
/// @param solution  of this scene on the ground
MatrixXd changes_by_variation_um(const sheet::OnGel& ground, const sheet::Scene& scene, const sheet::Solution& solution,
                                 const substrate::Substrate& gel, const std::vector<Vec2>& points_um);

/// "A contraction that varies by 20 % over the sheet would move the stiffness by 34 % …"; empty if that is fitted.
/// @param moved  by estimate, as add_error() has them
std::string sentence_of_variation(const std::vector<FittedEstimate>& estimates, const VectorXd& moved);

}  // namespace mbtfm::sheets
