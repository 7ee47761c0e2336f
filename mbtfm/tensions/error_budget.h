/// How much of each tension's standard error comes from what: docs/theory/errors.md, "Error budget".
#pragma once

#include <vector>

#include "mbtfm/tensions/linear_data.h"
#include "network/contractile.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/gel.h"
#include "pipeline/contract/results.h"
#include "pipeline/stage/parameters_fwd.h"

namespace mbtfm::tensions {

struct EnsembleFit;

/// Standard errors of what the segmentation measures. Found on simulated cells of ordinary image quality, outliers
/// included (notes/cost-tables.md). For a segmentation that is known to be exact: zero.
struct SegmentationErrors {
  double adhesion_shift_error_um = 0.017;  ///< of each coordinate of a centre
  double adhesion_area_error = 0.1;        ///< relative
  double adhesion_angle_error_deg = 1.2;
  double fibre_end_error_um = 0.2;  ///< of a free end, along the fibre
};
void declare(stage::ParameterList& list, SegmentationErrors& errors);

/// What the budget is drawn up of. `substrate_error`: see Substrate::stated_error().
struct BudgetInputs {
  const EnsembleFit& fit;
  const LinearData& data;
  network::Ensemble networks;
  const Cell& cell;
  Gel gel;
  double substrate_error = 0;
  bool lacks_base = false;  ///< the substrate is a half-space
  SegmentationErrors segmentation;
  Index n_of_place = 0;  ///< of the data's motions, the last ones: they are the cell's place
};

/// The gel with another thickness, and with another Poisson's ratio, by what is stated of their errors: one each.
std::vector<Gel> gels_an_error_away(const Gel& gel);

/// By linear propagation about the solution: costs about as much as one step of the fit on one mesh.
ErrorBudget error_budget(const BudgetInputs& inputs, int threads);

}  // namespace mbtfm::tensions
