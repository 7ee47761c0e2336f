/// What the fit reports to its user, from what the ensemble of meshes found.
#pragma once

#include <string>
#include <vector>

#include "mbtfm/tensions/linear_data.h"
#include "mbtfm/tensions/tension_fit.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/figures.h"
#include "pipeline/contract/fit_summary.h"
#include "pipeline/contract/gel.h"
#include "pipeline/contract/path.h"
#include "pipeline/contract/results.h"
#include "pipeline/files/named_array.h"

namespace mbtfm::tensions {

struct EnsembleFit;

struct CellOnBeads {
  Cell cell;
  DisplacementField beads;  ///< without the flagged ones
  int n_flagged = 0;
};

/// @throws InvalidData where all beads lie to one side of all adhesions: a coordinate has the wrong sign, unit or
/// origin
void check_place(const DisplacementField& beads, const Cell& cell);

std::vector<int> adhesion_ids_of(const Cell& cell);

/// By group, with 95 % intervals.
std::vector<Tension> tensions_of(const EnsembleFit& fit);
/// By adhesion of the cell, with standard errors.
std::vector<AdhesionForce> forces_of(const EnsembleFit& fit, const Cell& cell);
FitSummary summary_of(const EnsembleFit& fit, const CellOnBeads& scene, double surface_tension_nN_per_um,
                      const FitParameters& parameters);
/// The model's displacement at the beads.
DisplacementField field_of(const VectorXd& forces_nN, const DisplacementField& beads, const LinearData& data);

/// @param more  further arrays, by bead
void write_displacement_vtp(const Path& file, const DisplacementField& measured, const DisplacementField& fitted,
                            const std::vector<files::NamedArray>& more = {});
void write_tractions_vtp(const Path& file, const Cell& cell, const std::vector<AdhesionForce>& forces);

// What the forces of a cell have done to its gel, and how they are laid out.

/// Figures of fit.json, each with its standard error:
///
///   strain_energy_fJ         ½ Σ F · u, u the mean displacement under an adhesion. Of an adhesion that nobody has seen
///                            (an anchor, a candidate) the size is assumed, and half of this energy with it: there u is
///                            that of the beads on it, or of the nearest four. A tighter load has more, unseen
///   contractile_moment_nN_um −tr P, P = Σ x Fᵀ symmetrised, about the adhesions' centre: positive where the cell
///                            contracts; its two parts along the axes of P, and the angle of the larger one; in space
///                            of what acts along the surface
///
/// The energy is that of the exact layer of the gel's thickness and modulus; without it where the modulus changes with
/// depth. No moments where the image cuts the cell: the forces beyond the cut are part of them.
/// Source: Butler, Tolić-Nørrelykke, Fabry, Fredberg, Am. J. Physiol. Cell Physiol. 282 (2002) C595, eqs. 17 to 20.
Figures energy_and_moments(const EnsembleFit& fit, const Cell& cell, const Gel& gel, bool is_even_gel, int threads);

// The noise of the bead displacements, from beads far from the cell (thesis 3.3).

/// At least 30 of those in use lie that far outside the outline: 60 components give a standard deviation to about 10 %.
bool has_far_beads(const LinearData& data, const Polygon& outline_um, double far_distance_um);

struct NoiseLevel {
  double sigma_um = 0;  ///< standard deviation of a component along the surface
  std::string source;
};

/// From what the model leaves unexplained at beads further than `far_distance_um` outside the outline: 1.4826 × the
/// median magnitude of a component, which outliers do not move. Without far beads: of all beads.
NoiseLevel noise_level(const LinearData& data, const VectorXd& forces_nN, const Polygon& outline_um,
                       double far_distance_um);

}  // namespace mbtfm::tensions
