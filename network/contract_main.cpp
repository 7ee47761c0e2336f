#include <algorithm>
#include <map>
#include <string>

#include "network/cables/cables.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/results.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/stage/effects.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"

namespace mbtfm {
namespace {

/// @throws InputError naming the fibres of the network without a tension
std::vector<double> tensions_by_group(const std::vector<int>& fibre_ids, const std::vector<Tension>& rows,
                                      const Path& file) {
  std::map<int, double> given;
  for (const Tension& row : rows) given[row.fibre_id] = row.tension_nN;
  std::vector<double> result;
  std::string missing;
  for (const int id : fibre_ids)
    if (given.contains(id))
      result.push_back(given[id]);
    else
      missing += (missing.empty() ? "" : ", ") + std::to_string(id);
  if (!missing.empty())
    throw InputError(file.string(), "a row for each fibre of the network", "none for fibre_id " + missing,
                     "fibre_id 0 is the actin network");
  return result;
}

struct ContractParameters {
  cables::CableParameters cables;
  stage::EffectSwitches effects;
};

void declare(stage::ParameterList& list, ContractParameters& p) {
  declare(list, p.cables);
  declare(list, p.effects, {"cable_elasticity"});
}

StageReport report_of(const cables::CableNetwork& cables, const cables::Equilibrium& equilibrium,
                      const Eigen::VectorXd& forces) {
  double total = 0;
  for (Eigen::Index i = 0; i < forces.size(); i += 2) total += forces.segment<2>(i).norm();
  const auto count = [&](CableState state) {
    return static_cast<std::int64_t>(std::ranges::count(equilibrium.link_states, state));
  };
  StageReport report;
  report.converged = equilibrium.report.converged;
  const std::int64_t n_slack = count(CableState::slack), n_taut = count(CableState::taut),
                     n_collapsed = count(CableState::collapsed);
  report.summary = equilibrium.report.reason + "; cables: " + std::to_string(n_slack) + " slack, " +
                   std::to_string(n_taut) + " taut, " + std::to_string(n_collapsed) + " collapsed";
  report.figures = {{"steps", std::int64_t{equilibrium.report.iterations}},
                    {"largest_net_force_nN", equilibrium.report.last_change},
                    {"energy_fJ", equilibrium.energy_fJ},
                    {"n_slack_cables", n_slack},
                    {"n_taut_cables", n_taut},
                    {"n_collapsed_cables", n_collapsed},
                    {"n_adhesions", static_cast<std::int64_t>(cables.adhesion_ids().size())},
                    {"total_force_nN", total}};
  return report;
}

}  // namespace
}  // namespace mbtfm

int main(int argc, char** argv) {
  using namespace mbtfm;
  using Kind = stage::FileArgument::Kind;
  return stage::run_stage<ContractParameters>(
      {.name = "contract",
       .files =
           {{"network", Kind::input}, {"tensions", Kind::input}, {"out", Kind::output}, {"reactions", Kind::output}}},
      argc, argv, [](const ContractParameters& parameters, stage::StageContext& context) {
        const Path tensions_file = context.input("tensions");
        cables::CableParameters cable_parameters = parameters.cables;
        Effect elasticity = stage::decided(EffectKind::cable_elasticity, parameters.effects.cable_elasticity, true,
                                           "one contraction: to ask for it would cost as much as to have it");
        if (!elasticity.is_on) cable_parameters.axial_stiffness_nN = 0;
        const cables::CableNetwork cables(files::read_network(context.input("network")), cable_parameters);
        const auto tensions = tensions_by_group(cables.fibre_ids(), files::read_tensions(tensions_file), tensions_file);
        const cables::Equilibrium equilibrium = cables.equilibrium(tensions);
        const std::vector<Vec2> by_vertex = cables.reactions_nN(tensions, equilibrium);
        std::vector<int> vertices;
        std::vector<Vec2> forces;
        for (std::size_t v = 0; v < by_vertex.size(); ++v)
          if (is_held(cables.network(), v)) {
            vertices.push_back(static_cast<int>(v));
            forces.push_back(by_vertex[v]);
          }
        files::write_contracted_network(context.output("out"), cables.network(), equilibrium.positions_um,
                                        equilibrium.link_force_nN, equilibrium.link_states);
        files::write_reactions(context.output("reactions"), vertices, forces);
        StageReport report = report_of(cables, equilibrium, cables.adhesion_forces_nN(tensions, equilibrium));
        report.effects = {elasticity};
        return report;
      });
}
