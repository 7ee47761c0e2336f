/// What the forces of a cell have done to its gel, and how they are laid out.
#pragma once

#include "pipeline/contract/cell.h"
#include "pipeline/contract/figures.h"
#include "pipeline/contract/gel.h"

namespace mbtfm::tensions {

struct EnsembleFit;

/// Figures of fit.json, each with its standard error:
///
///   strain_energy_fJ         ½ Σ F · u, u the mean displacement under an adhesion. Of an adhesion that nobody has seen
///                            (an anchor, a candidate) the size is assumed, and half of this energy with it: there u is
///                            that of the beads on it, or of the nearest four. A tighter load has more, unseen
///   contractile_moment_nN_um −tr P, P = Σ x Fᵀ symmetrised, about the adhesions' centre: positive where the cell
///                            contracts; its two parts along the axes of P, and the angle of the larger one
///
/// The energy is that of the exact layer of the gel's thickness and modulus; without it where the modulus changes with
/// depth. No moments where the image cuts the cell: the forces beyond the cut are part of them.
/// Source: Butler, Tolić-Nørrelykke, Fabry, Fredberg, Am. J. Physiol. Cell Physiol. 282 (2002) C595, eqs. 17 to 20.
Figures energy_and_moments(const EnsembleFit& fit, const Cell& cell, const Gel& gel, bool is_even_gel, int threads);

}  // namespace mbtfm::tensions
