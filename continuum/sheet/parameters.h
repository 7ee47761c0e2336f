/// What a user says of a sheet: the table [sheet] of cell.toml.
#pragma once

#include <optional>

#include "continuum/sheet/forward.h"
#include "pipeline/contract/effects.h"
#include "pipeline/contract/gel.h"
#include "pipeline/stage/parameters_fwd.h"

namespace mbtfm::sheet {

struct SheetParameters {
  std::optional<double> youngs_modulus_kPa;
  double poisson_ratio = 0.5;  ///< a cell keeps its volume: what it loses in area it gains in height
  std::optional<double> thickness_um;
  std::optional<double> contraction_nN_per_um, contraction_kPa;
  std::optional<double> edge_band_um;
  double line_tension_nN = 0;
  std::optional<double> adhesion_stiffness_nN_per_um3;
  std::optional<Ground> ground;
  std::optional<Strain> strain;
  ContractionMeasure contraction_measure = ContractionMeasure::surface_tension;
  std::optional<double> mesh_um;
};
void declare(stage::ParameterList& list, SheetParameters& parameters);

/// @throws UsageError naming what is missing
Material material_of(const SheetParameters& parameters);
/// s. @throws UsageError where it is given not at all or twice
double contraction_of(const SheetParameters& parameters);

// Which effects a sheet calls for: a number each, and a threshold. docs/effects.md has them.

/// β = κ_a (1 − ν) l_a / μ, l_a = √(M/κ_a): how far the gel gives way beside the adhesions' springs.
double gel_over_adhesions(const Material& material, double adhesion_nN_per_um3, const Gel& gel);
/// x = s (1 − ν) / (E h): the strain of a sheet that nothing holds.
double free_contraction(const Material& material, double contraction_nN_per_um);

inline constexpr double kLargestBeta = 0.04;     ///< on springs alone u is then 2.5 % off at most, the force 1 %
inline constexpr double kLargestStrain = 0.05;   ///< from there on u changes by 1 %
inline constexpr double kMostContraction = 0.4;  ///< beyond, St Venant and Kirchhoff's law collapses
inline constexpr double kThinnest = 0.02;        ///< h/R: a solid disc moves 2 to 4 % more than the sheet

/// The gel's response, or springs alone.
struct GroundChoice {
  Ground ground = Ground::gel;
  Effect effect;
};
/// @param asked  unset: by β, or by what is given
/// @throws UsageError where what is asked for is not given
GroundChoice decide_ground(std::optional<Ground> asked, const Material& material,
                           std::optional<double> adhesion_nN_per_um3, const std::optional<Gel>& gel);

/// Large strain: by x on springs, on a gel where it is asked for. It takes several times as long there, and a sheet
/// that is bonded to a soft gel may collapse at its free edge, under the law that is used, from x = 0.13 on.
Effect decide_strain(std::optional<Strain> asked, double free_contraction, Ground ground);

}  // namespace mbtfm::sheet
