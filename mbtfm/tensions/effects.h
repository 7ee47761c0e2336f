/// Which of the fit's own effects the data call for.
#pragma once

#include <optional>

#include "mbtfm/tensions/tension_fit.h"
#include "pipeline/contract/effects.h"

namespace mbtfm::tensions {

/// The loss to ask a fit for; unset leaves it to the residuals of the first fit (stray_beads).
std::optional<Loss> loss_of_switch(Switch setting, Loss robust_kind);

/// Robust loss, once the fit has used this one.
Effect robust_loss_effect(Switch setting, Loss used_loss);

/// Time coupling: where there is a frame before. A series' first frame has none, and starts afresh, whatever the
/// switch.
Effect decide_time_coupling(bool has_frame_before, Switch setting);

}  // namespace mbtfm::tensions
