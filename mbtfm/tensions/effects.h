/// Which of the fit's own effects the data call for.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

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

// What the tensions would be if an effect that is off were on: the fit made again with it, all else alike.

struct EnsembleFit;

struct Change {
  EffectKind effect;
  Eigen::VectorXd by_tension_nN;       ///< with the effect, less without; empty where only a bound is known
  std::optional<double> at_most = {};  ///< |change| / |t|, where only that is known
};

Change change_between(EffectKind effect, const EnsembleFit& without, const EnsembleFit& with);

/// |change| / |t| over the fibres, or of the network where there are none.
double relative(const Change& change, const EnsembleFit& fit);

/// "would change the tensions by 0.8 %, that of fibre 7 by 0.05 nN"; "by at most 3 %"
std::string sentence(const Change& change, const EnsembleFit& fit);

}  // namespace mbtfm::tensions
