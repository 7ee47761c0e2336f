/// What the meshes of an ensemble say together: means with their errors.
#pragma once

#include "mbtfm/tensions/ensemble.h"

namespace mbtfm::tensions {

/// Tensions, forces and their sums, once each mesh has its errors. @param is_cut  the image shows a part of the cell
void add_estimates(EnsembleFit& all, bool is_cut);
/// Of them those of the adhesions' forces: redone where these are.
void add_force_estimates(EnsembleFit& all, bool is_cut);

}  // namespace mbtfm::tensions
