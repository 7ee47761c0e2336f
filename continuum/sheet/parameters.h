/// What a user says of a sheet: the table [sheet] of cell.toml.
#pragma once

#include <optional>

#include "continuum/sheet/forward.h"
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

}  // namespace mbtfm::sheet
