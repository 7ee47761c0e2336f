/// A sheet whose outline lies elsewhere, on the same triangles: another mesh would differ by more than the outline
/// does.
#pragma once

#include "continuum/sheet/elements.h"

namespace mbtfm::sheet {

/// The rims lie further out by this much: the sheet grows, its holes shrink. Inside, nodes follow as those of an
/// elastic sheet whose rims are pulled there.
/// @param n_rims  curves 0 … n_rims − 1 are rims: the outer one, then holes
/// @throws InvalidData where a triangle is turned inside out
Elements with_rims_further_out(const Elements& elements, int n_rims, double outward_um);

}  // namespace mbtfm::sheet
