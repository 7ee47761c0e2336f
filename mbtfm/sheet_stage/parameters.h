/// What a user says to mbtfm-sheet.
#pragma once

#include <array>
#include <optional>

#include "continuum/sheet/from_traction.h"
#include "continuum/sheet/parameters.h"
#include "mbtfm/tensions/tension_fit.h"
#include "pipeline/contract/gel.h"
#include "substrate/choice/factory.h"

namespace mbtfm::sheet_stage {

using namespace sheet;  // this room speaks of nothing else

/// Which parts of a sheet have a contraction of their own.
enum class Parts { none, edge, cells, field };
constexpr auto words(Parts) { return std::array{"none", "edge", "cells", "field"}; }

struct Parameters {
  std::optional<double> pixel_size_um;
  std::optional<double> gel_modulus_kPa;  ///< unset: there is no gel
  Gel gel;
  substrate::SubstrateParameters substrate;
  SheetParameters sheet;
  double most_unbalanced = kMostUnbalanced;
  std::optional<double> traction_sigma_kPa, traction_correlation_um;
  Parts fit_parts = Parts::none;                  ///< the simplest
  int field_points = 40;                          ///< a colony's beads determine fewer numbers
  bool fit_line_tension = false;                  ///< most colonies have none
  bool fit_adhesion_stiffness = false;            ///< few beads distinguish it from the sheet's own
  std::optional<double> outline_error_um;         ///< unset: by its source
  tensions::Loss loss = tensions::Loss::squares;  ///< beads are Gaussian to first order
};

void declare(stage::ParameterList& list, Parameters& p);

}  // namespace mbtfm::sheet_stage
