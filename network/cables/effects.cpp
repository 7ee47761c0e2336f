#include "network/cables/effects.h"

#include <algorithm>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/stopwatch.h"

namespace mbtfm::cables {

Effect take_fibres(Cell& cell, Switch setting) {
  if (setting == Switch::on && cell.fibres.empty())
    throw InvalidData("effects.stress_fibres = on", "a stress fibre in fibres.csv", "none");
  const Effect effect =
      stage::decided(EffectKind::stress_fibres, setting, static_cast<double>(cell.fibres.size()), 0, "number found:");
  if (!effect.is_on) cell.fibres.clear();
  return effect;
}

double stretch_share(const Network& network, const Equilibrium& equilibrium, double axial_stiffness_nN) {
  const std::vector<Link>& links = network.links;
  double stretch = 0, all = 0;
  for (std::size_t k = 0; k < links.size(); ++k) {
    const double strain = norm(equilibrium.spans_um[k]) / links[k].rest_length_um - 1;
    stretch += links[k].share * axial_stiffness_nN * std::max(0.0, strain);
    all += equilibrium.link_force_nN[k];
  }
  return all > 0 ? std::min(1.0, stretch / all) : 0;
}

Effect decide_elasticity(const CableNetwork& cables, const std::vector<double>& tensions_nN,
                         const stage::EffectSwitches& switches) {
  constexpr EffectKind kKind = EffectKind::cable_elasticity;
  if (switches.cable_elasticity != Switch::automatic)
    return stage::decided(kKind, switches.cable_elasticity, true, "as asked");
  const Stopwatch watch;
  const double share =
      stretch_share(cables.network(), cables.equilibrium(tensions_nN), cables.parameters().axial_stiffness_nN);
  Effect effect = stage::decided(kKind, Switch::automatic, share, switches.effect_tolerance,
                                 "where all cables pull alike, the share of their force that resists stretching is");
  effect.seconds = watch.seconds();
  return effect;
}

}  // namespace mbtfm::cables
