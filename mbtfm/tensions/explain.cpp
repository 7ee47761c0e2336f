#include "mbtfm/tensions/explain.h"

#include <cmath>

#include "mbtfm/tensions/ensemble.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::tensions {

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
