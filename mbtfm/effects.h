/// Which of the fit's own effects the data call for.
#pragma once

#include "mbtfm/linear_data.h"
#include "mbtfm/tension_fit.h"
#include "pipeline/contract/effects.h"

namespace mbtfm::inverse {

/// Residuals of the best adhesion forces, whatever network may carry them: their tails are the beads', not the model's.
struct Tails {
  double share = 0;   ///< of the beads beyond 3.5 robust standard deviations; 0.0022 where the noise is Gaussian
  double excess = 0;  ///< variance of an estimate by squares over that by the robust loss, less 1; -0.05 for Gaussian
};
Tails tails_of(const LinearData& data, const std::string& robust_kind);

/// Robust loss: where squares give the estimates a larger variance than the robust loss would, by as much as the loss
/// gives away where the noise is Gaussian: less is not worth a second way of weighing.
Effect decide_robust_loss(const LinearData& data, const FitParameters& parameters, const std::string& setting);

/// Time coupling: where there is a frame before. A series' first frame has none, and starts afresh, whatever the
/// switch.
Effect decide_time_coupling(bool has_frame_before, const std::string& setting);

}  // namespace mbtfm::inverse
