/// Which of the fit's own effects the data call for.
#pragma once

#include <string>

#include "pipeline/stage/effects.h"

namespace mbtfm::tensions {

/// The loss to ask a fit for: `auto` leaves it to the residuals of the first fit (stray_beads).
std::string loss_of_switch(const std::string& setting, const std::string& robust_kind);

/// Robust loss, once the fit has used this one.
Effect robust_loss_effect(const std::string& setting, const std::string& used_loss);

/// Time coupling: where there is a frame before. A series' first frame has none, and starts afresh, whatever the
/// switch.
Effect decide_time_coupling(bool has_frame_before, const std::string& setting);

}  // namespace mbtfm::tensions
