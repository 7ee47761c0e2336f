/// What the tensions would be if an effect that is off were on: the fit made again with it, all else alike.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/effects.h"

namespace mbtfm::tensions {

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
