/// Fourier transform traction cytometry on scattered beads, regularised.
#pragma once

#include "mbtfm/tractions/lattice_problem.h"
#include "mbtfm/tractions/regularisation.h"
#include "mbtfm/tractions/traction.h"

namespace mbtfm::tractions {

// The criteria are flat where they are best: a hundredth of the tractions, in energy, moves none of them.
inline constexpr double kScanTolerance = 1e-2;
inline constexpr double kTolerance = 1e-3;  ///< in energy: far below any error bar

/// That this problem can tell apart, falling.
std::vector<double> lambdas_of(const LatticeProblem& problem);

/// The criteria over the lambdas that this problem can tell apart. @param solver  of the problem's data: left near one
LambdaScan scan_lambda(const LatticeProblem& problem, TikhonovSolver& solver);

LatticeOptions lattice_options(const TractionParameters& parameters, int threads);

/// The nodes of the field, rows first. @param displacements  of the box
std::vector<GroundPatch> patches_of(const LatticeProblem& problem, const std::vector<Vec2>& tractions_kPa,
                                    const NodeField& displacements);

/// Vectors at the nodes of the field, rows first.
std::vector<Vec2> on_field(const LatticeProblem& problem, const NodeField& nodes);

/// Where all displacements are zero: no tractions, and a remark that says so.
Reconstruction reconstruction_of_nothing(const LatticeProblem& problem, const TractionInputs& inputs);

/// Waves of traction to vectors at the nodes of the field, rows first. @param gaussian_um  smooths them; 0: not
std::vector<Vec2> tractions_kPa(const LatticeProblem& problem, const WaveField& waves, ReadOut read_out,
                                double gaussian_um);

}  // namespace mbtfm::tractions
