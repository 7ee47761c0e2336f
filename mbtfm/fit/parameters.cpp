#include "mbtfm/fit/parameters.h"

#include "mbtfm/fit/effects.h"
#include "mbtfm/tensions/effects.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::fit {

void declare(stage::ParameterList& list, Parameters& p) {
  declare(list, p.gel);
  declare(list, p.network);
  declare(list, p.cables);
  declare(list, p.substrate);
  declare(list, p.fit);
  declare(list, p.segmentation);
  list.add("compare_sheet", p.compare_sheet);
  list.add("explain", p.explain);
  declare(list, p.effects, effect_keys());
}

Parameters as_switched(Parameters parameters) {
  parameters.substrate.effects = parameters.effects;
  parameters.substrate.effects.large_strain = Switch::off;  // forces call for it: the fit adds it to a linear model
  parameters.fit.loss = tensions::loss_of_switch(parameters.effects.robust_loss, parameters.fit.robust_kind);
  return parameters;
}

}  // namespace mbtfm::fit
