/// How far the models are known to be from the exact answer.
#pragma once

#include "substrate/compliance.h"

namespace mbtfm::substrate {

/// Of `split` with 2 cells of its grid over the thickness (docs/accuracy.md); it falls as the cube of their size.
inline constexpr double kSplitErrorOfTwoCells = 1e-3;

/// Relative L2 error of an ellipse's displacements, mean over ellipses, that a model has made in the call its figures
/// are of: as it estimated it, or as its accuracy was measured. What `half-space` leaves out, the base, is not in it.
double stated_error(const SubstrateParameters& parameters, const Figures& figures);

}  // namespace mbtfm::substrate
