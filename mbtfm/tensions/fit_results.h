/// What the fit tells its user, from what the ensemble of meshes found.
#pragma once

#include <vector>

#include "mbtfm/tensions/linear_data.h"
#include "mbtfm/tensions/tension_fit.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/fit_summary.h"
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

}  // namespace mbtfm::tensions
