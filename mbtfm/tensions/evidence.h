/// What speaks for a model of the adhesions' forces that may itself be wrong:
///
///   u = G (R + δ) + n,   δ ~ N(0, τ²) by component,
///
/// with R the model's forces and τ² of greatest likelihood. Without δ all models are wrong in the same way where beads
/// are many: the one with the most parameters wins, whatever they mean. With R = 0 it is the model of forces that know
/// nothing of each other.
/// Source: Kennedy & O'Hagan, J. R. Stat. Soc. B 63 (2001) 425; Schwarz, Ann. Stat. 6 (1978) 461.
#pragma once

#include <vector>

#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/linear_data.h"
#include "pipeline/contract/cell.h"

namespace mbtfm::tensions {

/// Fills in `discrepancy_nN` and `bic_with_discrepancy` of each, from its `left_um`.
void weigh_with_discrepancy(std::vector<ModelScore>& models, const LinearData& data);

// Is a segmented line a fibre? What the image and the beads show of it together.

/// Logarithm of the odds that a line is a fibre. Fibres pull with |N(0, τ²)|, other lines do not pull:
///
///   ln p/(1 − p) + ln ∫₀^∞ N(t; s, σ²) 2N(s; 0, τ²) ds / N(t; 0, σ²) = ln p/(1 − p) + ln(2σ/w) + x²/2 + ln Φ(x),
///
/// w² = σ² + τ², x = tτ/(σw). Source: Kass & Raftery, J Am Stat Assoc 90 (1995) 773, (1).
/// @param confidence  p, by the image: 0 to 1
/// @param tension_nN, sigma_nN  t and its standard error σ > 0, by the beads
/// @param usual_nN  τ > 0
double log_odds(double confidence, double tension_nN, double sigma_nN, double usual_nN);

/// By fitted fibre, in the order of the fit: the probability that it is one. τ is the root mean square of the other
/// tensions of its type; those of all types count as one more of them. A confidence of 1 (drawn by hand) stays 1.
/// @param fibres  all that the fit has are among them
std::vector<double> existence_of(const EnsembleFit& fit, const std::vector<Fibre>& fibres);

}  // namespace mbtfm::tensions
