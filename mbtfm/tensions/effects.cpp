#include "mbtfm/tensions/effects.h"

#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/stage/effects.h"

namespace mbtfm::tensions {

std::optional<Loss> loss_of_switch(Switch setting, Loss robust_kind) {
  if (setting == Switch::automatic) return std::nullopt;
  return setting == Switch::on ? robust_kind : Loss::squares;
}

Effect robust_loss_effect(Switch setting, Loss used_loss) {
  const bool is_robust = used_loss != Loss::squares;
  const std::string why =
      is_robust ? std::string(name_of(used_loss)) +
                      ": outlying beads move a tension by more than a tenth of its standard error, or widen the "
                      "standard errors as much"
                : "no beads are outliers, or they move and widen no tension by a tenth of its standard error";
  return stage::decided(EffectKind::robust_loss, setting, is_robust, why);
}

Effect decide_time_coupling(bool has_frame_before, Switch setting) {
  Effect effect = stage::decided(EffectKind::time_coupling, setting, has_frame_before ? 1 : 0, 0,
                                 "number of frames before this one:");
  effect.is_on = effect.is_on && has_frame_before;
  return effect;
}

}  // namespace mbtfm::tensions
