#include "mbtfm/fit/checks.h"

#include <algorithm>
#include <limits>

#include "mbtfm/sheets/beside_fibres.h"
#include "mbtfm/tensions/evidence.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::fit {

using namespace tensions;

namespace {

/// Draws take the tensions of this cell's own fibres of a type. None where it lacks dorsal or ventral ones.
std::optional<CrossValidation> cross_validation_of(const ReadyCell& ready, const EnsembleFit& fit, int n_draws,
                                                   int threads) {
  const Cell& cell = ready.scene.cell;
  TypeTensions tensions;
  std::vector<FibreType> types;
  for (std::size_t i = 1; i < fit.tensions.fibre_ids.size(); ++i) {
    const auto fibre = std::find_if(cell.fibres.begin(), cell.fibres.end(),
                                    [&](const Fibre& f) { return f.fibre_id == fit.tensions.fibre_ids[i]; });
    types.push_back(fibre->type == FibreType::edge ? FibreType::ventral : fibre->type);  // held alike, at both ends
    tensions[types.back()].push_back(fit.tensions.nN[i].value);
  }
  if (n_draws == 0 || !tensions.contains(FibreType::dorsal) || !tensions.contains(FibreType::ventral)) return {};
  const TensionProblem problem(ready.networks.front(), fit.data.reduced, adhesion_ids_of(cell));
  return cross_validate(problem, fit.data, fit.meshes.front().fit.trial, types, tensions, n_draws, 1, threads);
}

/// A fit of a sheet takes as long as that of the cell. It is worth it if fibres are in doubt: the network alone does as
/// well by BIC, or carries more than half of the force.
bool is_sheet_asked(Switch asked, const std::vector<ModelScore>& models, const EnsembleFit& fit) {
  if (asked != Switch::automatic) return asked == Switch::on;
  const auto bic_of = [&](const char* name) {
    const auto model = std::ranges::find(models, name, &ModelScore::name);
    return model == models.end() ? std::numeric_limits<double>::infinity() : model->bic;
  };
  return bic_of("no-fibres") <= bic_of("full") || 2 * fit.network_force_nN.value > fit.total_force_nN.value;
}

}  // namespace

FoundMotions motions_found(const ReadyCell& cell, const EnsembleFit& fit, const stage::EffectSwitches& switches) {
  const MotionsBeside motions = motions_beside(fit.data, fit);
  FoundMotions found;
  if (cell.decisions.placement.is_on) found.placement = placement_among(motions, cell.placement);
  if (!allows_common_motion(switches)) return found;
  found.common = common_motion_among(motions, fit.data);
  found.curved = curved_motion_beside(fit);
  return found;
}

Figures figures_of(const FoundMotions& found) {
  Figures figures = found.common ? tensions::figures_of(*found.common) : Figures{};
  if (!found.placement) return figures;
  for (const auto& figure : tensions::figures_of(*found.placement)) figures.push_back(figure);
  return figures;
}

ModelChecks check_model(const ReadyCell& cell, const EnsembleFit& fit, const Parameters& p, int threads) {
  const LinearData& data = fit.data;
  const Cell& of = cell.scene.cell;
  ModelChecks checks{.models = compare_models(fit, data, cell.networks.front(), adhesion_ids_of(of)),
                     .influence = influence_of(fit, data),
                     .left_out = {},
                     .missing_fibres = {},
                     .missing_adhesions = {},
                     .drawn = cross_validation_of(cell, fit, p.fit.cross_validation, threads)};
  checks.left_out = leave_each_fibre_out(fit, checks.influence);
  const std::vector<double> existence = existence_of(fit, of.fibres);
  for (std::size_t i = 0; i < existence.size(); ++i) checks.left_out[i].existence = existence[i];
  if (is_sheet_asked(p.compare_sheet, checks.models, fit)) {
    for (ModelScore& sheet : sheets::scores_of_sheets(data, of, p.gel, *cell.gel, threads))
      checks.models.push_back(std::move(sheet));
  }
  weigh_with_discrepancy(checks.models, data);
  return checks;
}

Figures figures_of(const ModelChecks& checks, const EnsembleFit& fit) {
  const auto best = std::ranges::min_element(checks.models, {}, &ModelScore::bic_with_discrepancy);
  std::vector<std::int64_t> unsupported;
  for (const FibreLeftOut& f : checks.left_out)
    if (f.aic_rise <= 0) unsupported.push_back(f.fibre_id);
  const auto cables = std::ranges::find(checks.models, "full", &ModelScore::name);
  return {{"best_model_by_bic", best->name},
          {"bic_of_cables_over_best", cables->bic_with_discrepancy - best->bic_with_discrepancy},
          {"fibres_not_told_apart", names_of_groups(fit)},
          {"fibres_without_support", unsupported},
          {"n_missing_fibres_hinted", std::int64_t(checks.missing_fibres.size())}};
}

std::vector<std::string> names_of_groups(const EnsembleFit& fit) {
  std::vector<std::string> names;
  for (const FibreGroup& group : fibres_not_distinguished(fit)) {
    std::string& text = names.emplace_back();
    for (std::size_t k = 0; k < group.indices.size(); ++k)
      text += (k > 0 ? " + " : "") + std::to_string(fit.tensions.fibre_ids[group.indices[k]]);
    text += ": " + brief(group.sum_nN.value) + " ± " + brief(group.sum_nN.standard_error) + " nN";
  }
  return names;
}

}  // namespace mbtfm::fit
