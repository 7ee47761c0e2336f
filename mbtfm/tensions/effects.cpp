#include "mbtfm/tensions/effects.h"

#include "mbtfm/tensions/ensemble.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/numbers.h"
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

Change change_between(EffectKind effect, const EnsembleFit& without, const EnsembleFit& with) {
  const VectorXd before = values_of(without);
  return {effect, values_of(with).head(before.size()) - before};
}

double relative(const Change& change, const EnsembleFit& fit) {
  if (change.at_most) return *change.at_most;
  const VectorXd tensions = values_of(fit);
  const Index n = tensions.size() > 1 ? tensions.size() - 1 : 1;
  const double size = tensions.tail(n).norm();
  return size > 0 ? change.by_tension_nN.tail(n).norm() / size : 0;
}

std::string sentence(const Change& change, const EnsembleFit& fit) {
  const std::string percent = brief(100 * relative(change, fit)) + " %";
  if (change.at_most) return "would change the tensions by at most " + percent;
  Index most = 0;
  const double largest = change.by_tension_nN.cwiseAbs().maxCoeff(&most);
  const int id = fit.tensions.fibre_ids[most];
  return "would change the tensions by " + percent + ", that of " +
         (id == 0 ? "the network" : "fibre " + std::to_string(id)) + " by " + brief(largest) + " nN";
}

}  // namespace mbtfm::tensions
