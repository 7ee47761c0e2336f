#include "mbtfm/tensions/effects.h"

namespace mbtfm::tensions {

std::string loss_of_switch(const std::string& setting, const std::string& robust_kind) {
  if (setting == "auto") return "auto";
  return setting == "on" ? robust_kind : "squares";
}

Effect robust_loss_effect(const std::string& setting, const std::string& used_loss) {
  const bool is_robust = used_loss != "squares";
  return stage::decided(
      "robust loss", setting, is_robust,
      is_robust ? used_loss +
                      ": the first fit leaves residuals, alone among their neighbours, that Gaussian noise has in one "
                      "case of twenty, and they move a tension by a tenth of its standard error or more"
                : "the first fit leaves no residuals, alone among their neighbours, that are too large for Gaussian "
                  "noise and that move a tension by a tenth of its standard error");
}

Effect decide_time_coupling(bool has_frame_before, const std::string& setting) {
  Effect effect =
      stage::decided("time coupling", setting, has_frame_before ? 1 : 0, 0, "number of frames before this one:");
  effect.is_on = effect.is_on && has_frame_before;
  return effect;
}

}  // namespace mbtfm::tensions
