/// What is asked of a fit besides its tensions: what else the beads do, and whether the model is the right one.
#pragma once

#include <optional>
#include <vector>

#include "mbtfm/fit/ready_cell.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/missing_adhesions.h"
#include "mbtfm/tensions/model_checks.h"

namespace mbtfm::fit {

/// Motions that were found with the tensions; none of those that were not allowed for.
struct FoundMotions {
  std::optional<tensions::FoundMotion> common;
  std::optional<tensions::FoundPlacement> placement;
  std::optional<tensions::CurvedMotion> curved;  ///< asked of what is left
};
FoundMotions motions_found(const ReadyCell& cell, const tensions::EnsembleFit& fit,
                           const stage::EffectSwitches& switches);
/// Of fit.json.
Figures figures_of(const FoundMotions& found);

struct ModelChecks {
  std::vector<tensions::ModelScore> models;
  tensions::Influence influence;
  std::vector<tensions::FibreLeftOut> left_out;
  std::vector<MissingFibre> missing_fibres;        ///< that the fit has besides those of the network
  std::vector<MissingAdhesion> missing_adhesions;  ///< likewise
  std::optional<tensions::CrossValidation> drawn;
};
/// All but what is missing.
ModelChecks check_model(const ReadyCell& cell, const tensions::EnsembleFit& fit, const Parameters& parameters,
                        int threads);
/// Of fit.json.
Figures figures_of(const ModelChecks& checks, const tensions::EnsembleFit& fit);

/// "3 + 7: 5.2 ± 0.1 nN"
std::vector<std::string> names_of_groups(const tensions::EnsembleFit& fit);

}  // namespace mbtfm::fit
