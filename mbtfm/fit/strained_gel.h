/// The fit again where the forces found strain the gel beyond linear elasticity: Gauss–Newton, the gel's response taken
/// about the forces of the fit before.
#pragma once

#include <functional>

#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/tension_fit.h"
#include "pipeline/contract/effects.h"
#include "pipeline/contract/work.h"

namespace mbtfm::fit {

struct GelUnderCell;

/// Whether the forces found call for it.
/// @throws UsageError where it is switched on, and the scene has what keeps it off
Effect decide_strain(const GelUnderCell& on, const tensions::EnsembleFit& fit, bool is_series);

/// A fit of these data, from tensions that are near.
using Refit = std::function<tensions::EnsembleFit(tensions::LinearData data, const tensions::Trial& start)>;

struct StrainedScene {
  const GelUnderCell& on;
  const DisplacementField& beads;
  bool is_under_load = false;  ///< images and beads were taken while the cell pulls
};
/// Large strains are counted from the gel at rest: beads and adhesions that were seen under load are led back to it.
/// @param fit  on the linear gel
/// @throws NotSolved where the gel finds no state under these forces, or the fits do not settle
tensions::EnsembleFit fit_on_strained_gel(const StrainedScene& scene, tensions::EnsembleFit fit, const Refit& refit,
                                          const Work& work);

}  // namespace mbtfm::fit
