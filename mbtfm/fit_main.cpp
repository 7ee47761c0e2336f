/// mbtfm-fit: tensions, adhesion forces and their error bars from bead displacements.
#include <algorithm>
#include <chrono>
#include <cmath>
#include <map>
#include <memory>
#include <mutex>

#include "mbtfm/cross_validation.h"
#include "mbtfm/error_budget.h"
#include "mbtfm/fit_results.h"
#include "mbtfm/model_checks.h"
#include "network/mesh.h"
#include "pipeline/contract/csv.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/files.h"
#include "pipeline/contract/parallel.h"
#include "pipeline/contract/stage.h"
#include "substrate/compliance.h"
#include "substrate/gel_vtu.h"
#include "substrate/stated_error.h"

namespace mbtfm::inverse {
namespace {

// Chi squared per degree of freedom. Cells that follow the model, fitted on other networks, were found at 0.99 to 1.16.
constexpr double kPoorFit = 1.3;

struct FitStageParameters {
  Gel gel;
  network::NetworkParameters network;
  network::CableParameters cables;
  substrate::SubstrateParameters substrate;
  FitParameters fit;
  SegmentationErrors segmentation;
};

void declare(ParameterList& list, FitStageParameters& p) {
  declare(list, p.gel);
  declare(list, p.network);
  declare(list, p.cables);
  declare(list, p.substrate);
  declare(list, p.fit);
  declare(list, p.segmentation);
}

FitInputs read_inputs(StageContext& context) {
  FitInputs inputs{.cell = read_cell(context.input("cell", kCellFiles)),
                   .network = read_network(context.input("network")),
                   .beads = {}};
  const Path field = context.input("displacement");
  for (Bead& bead : read_displacement(field)) {
    if (bead.flag.empty())
      inputs.beads.push_back(std::move(bead));
    else
      ++inputs.n_flagged;
  }
  return inputs;
}

std::vector<int> adhesion_ids_of(const Cell& cell) {
  std::vector<int> ids;
  for (const Adhesion& a : cell.adhesions) ids.push_back(a.adhesion_id);
  return ids;
}

std::vector<substrate::Ellipse> ellipses_of(const Cell& cell) {
  std::vector<substrate::Ellipse> ellipses;
  for (const Adhesion& a : cell.adhesions) ellipses.push_back(substrate::ellipse_of(a));
  return ellipses;
}

Eigen::MatrixXd compliance_of(const substrate::Substrate& substrate, const FitInputs& inputs) {
  std::vector<Vec2> points;
  for (const Bead& b : inputs.beads) points.push_back(b.position_um);
  return substrate.compliance_um_per_nN(points, ellipses_of(inputs.cell));
}

std::vector<bool> beads_in_region(const FitInputs& inputs, const FitParameters& p) {
  std::vector<bool> is_used;
  for (const Bead& b : inputs.beads) {
    is_used.push_back(!p.region_um || contains(inputs.cell.outline_um, b.position_um) ||
                      distance_to_boundary_um(inputs.cell.outline_um, b.position_um) <= *p.region_um);
  }
  return is_used;
}

/// The thesis' way: the displacements of each trial are solved for. One at a time, as the solver has threads of its
/// own.
SolvedMisfit solved_misfit(const substrate::Substrate& substrate, const FitInputs& inputs, const LinearData& data) {
  std::vector<Vec2> points;
  for (const Bead& b : inputs.beads) points.push_back(b.position_um);
  const auto one_at_a_time = std::make_shared<std::mutex>();
  return
      [&substrate, &data, points, ellipses = ellipses_of(inputs.cell), one_at_a_time](const Eigen::VectorXd& forces) {
        std::vector<Vec2> forces_nN;
        for (Eigen::Index i = 0; i < forces.size(); i += 2) forces_nN.push_back({forces[i], forces[i + 1]});
        const std::lock_guard lock(*one_at_a_time);
        const std::vector<Vec2> u = substrate.displacements_um(points, ellipses, forces_nN);
        double sum = 0;
        for (std::size_t i = 0; i < u.size(); ++i) {
          const auto row = 2 * static_cast<Eigen::Index>(i);
          const Vec2 misfit_um = u[i] - Vec2{data.displacement_um[row], data.displacement_um[row + 1]};
          sum += std::pow(data.weight_per_um[row], 2) * dot(misfit_um, misfit_um);
        }
        return sum;
      };
}

/// The given network first, then further ones over the same cell from other seeds.
std::vector<network::CableNetwork> span_ensemble(const FitInputs& inputs, const FitStageParameters& p, int threads) {
  std::vector<Network> networks(p.fit.n_meshes);
  networks[0] = inputs.network;
  parallel_for(p.fit.n_meshes - 1, threads, [&](int m) {
    network::NetworkParameters parameters = p.network;
    parameters.seed += static_cast<std::uint64_t>(m) + 1;
    networks[m + 1] = network::generate_network(inputs.cell, parameters).network;
  });
  std::vector<network::CableNetwork> cables;
  for (Network& network : networks) cables.emplace_back(std::move(network), p.cables);
  return cables;
}

void write_surface(const Path& file, const substrate::Substrate& substrate, const Cell& cell,
                   const std::vector<AdhesionForce>& forces, int n_lines) {
  std::vector<Vec2> forces_nN;
  for (const AdhesionForce& f : forces) forces_nN.push_back(f.force_nN);
  substrate::write_substrate_vtu(file, substrate, ellipses_of(cell), forces_nN, n_lines);
}

std::vector<Effect> effects_of(const substrate::Substrate& substrate, const FitInputs& inputs, const FitParameters& p) {
  std::vector<Effect> effects = substrate.effects();
  const std::string n_fibres = std::to_string(inputs.cell.fibres.size());
  effects.push_back({.name = "stress fibres in the network",
                     .is_on = !inputs.cell.fibres.empty(),
                     .why = n_fibres + " fibres were segmented"});
  effects.push_back({.name = "mesh ensemble",
                     .is_on = p.n_meshes > 1,
                     .why = p.n_meshes > 1
                                ? std::to_string(p.n_meshes) + " meshes: their spread is part of the error bars"
                                : "one mesh: the error bars hold the bead noise only"});
  return effects;
}

/// "3 + 7: 5.2 ± 0.1 nN; …"
std::string names_of_groups(const EnsembleFit& fit) {
  std::string text;
  for (const FibreGroup& group : fibres_not_told_apart(fit)) {
    if (!text.empty()) text += "; ";
    for (std::size_t k = 0; k < group.indices.size(); ++k) {
      text += (k > 0 ? " + " : "") + std::to_string(fit.fibre_ids[static_cast<std::size_t>(group.indices[k])]);
    }
    text += ": " + brief(group.sum_nN.value) + " ± " + brief(group.sum_nN.standard_error()) + " nN";
  }
  return text;
}

ErrorBudget budget_of(const EnsembleFit& fit, const LinearData& data,
                      const std::vector<network::CableNetwork>& networks, const FitInputs& inputs,
                      const substrate::Substrate& substrate, const FitStageParameters& p, int threads) {
  const Figures figures = substrate.figures();
  const bool lacks_base = std::find(figures.begin(), figures.end(),
                                    Figures::value_type{"substrate_model", std::string("half-space")}) != figures.end();
  return error_budget({.fit = fit,
                       .data = data,
                       .networks = networks,
                       .cell = inputs.cell,
                       .beads = inputs.beads,
                       .gel = p.gel,
                       .substrate_error = substrate::stated_error(p.substrate, figures),
                       .lacks_base = lacks_base,
                       .segmentation = p.segmentation},
                      threads);
}

/// The checks of the model in a few figures.
Figures figures_of(const EnsembleFit& fit, const std::vector<ModelScore>& models,
                   const std::vector<FibreLeftOut>& left_out, const std::vector<MissingFibre>& missing) {
  const auto best = std::min_element(models.begin(), models.end(),
                                     [](const ModelScore& a, const ModelScore& b) { return a.bic < b.bic; });
  std::string unsupported;
  for (const FibreLeftOut& f : left_out) {
    if (f.aic_rise <= 0) unsupported += (unsupported.empty() ? "" : ", ") + std::to_string(f.fibre_id);
  }
  return {{"best_model_by_bic", best->name},
          {"fibres_not_told_apart", names_of_groups(fit)},
          {"fibres_without_support", unsupported},
          {"n_missing_fibres_hinted", std::int64_t(missing.size())}};
}

PointArray most_informed_array(const EnsembleFit& fit, const LinearData& data) {
  PointArray array{.name = "informs_fibre_id", .scalars = {}, .vectors = {}};
  for (const int id : most_informed_fibre(fit, data)) array.scalars.push_back(id);
  return array;
}

/// What the loss and the region leave of each bead.
PointArray weight_array(const LinearData& data) {
  PointArray array{.name = "weight", .scalars = {}, .vectors = {}};
  for (Eigen::Index b = 0; b < data.bead_weight.size(); ++b) {
    array.scalars.push_back(data.weight_per_um[2 * b] > 0 ? data.bead_weight[b] : 0);
  }
  return array;
}

/// The tensions of the frame before, by the network's groups; fibres that are new since then at the others' mean.
std::optional<Eigen::VectorXd> start_of(StageContext& context, const std::vector<int>& fibre_ids) {
  if (!context.has_input("start")) return std::nullopt;
  std::map<int, double> known;
  double sum = 0;
  for (const Tension& t : read_tensions(context.input("start"))) {
    known[t.fibre_id] = t.tension_nN;
    sum += t.tension_nN;
  }
  Eigen::VectorXd start(static_cast<Eigen::Index>(fibre_ids.size()));
  for (std::size_t i = 0; i < fibre_ids.size(); ++i) {
    const auto found = known.find(fibre_ids[i]);
    start[static_cast<Eigen::Index>(i)] =
        found != known.end() ? found->second : sum / static_cast<double>(std::max<std::size_t>(1, known.size()));
  }
  return start;
}

/// Draws take the tensions of this cell's own fibres of a type. None where it lacks dorsal or ventral ones.
std::optional<CrossValidation> cross_validation_of(const EnsembleFit& fit, const LinearData& data,
                                                   const network::CableNetwork& network, const Cell& cell,
                                                   const FitParameters& p, int threads) {
  TypeTensions tensions;
  std::vector<FibreType> types;
  for (std::size_t i = 1; i < fit.fibre_ids.size(); ++i) {
    const auto fibre = std::find_if(cell.fibres.begin(), cell.fibres.end(),
                                    [&](const Fibre& f) { return f.fibre_id == fit.fibre_ids[i]; });
    types.push_back(fibre->type);
    tensions[fibre->type].push_back(fit.tensions_nN[i].value);
  }
  if (p.cross_validation == 0 || !tensions.contains(FibreType::dorsal) || !tensions.contains(FibreType::ventral)) {
    return std::nullopt;
  }
  const TensionProblem problem(network, data.reduced, adhesion_ids_of(cell));
  return cross_validate(problem, data, fit.meshes.front().fit.trial, types, tensions, p.cross_validation, 1, threads);
}

StageReport fit(const FitStageParameters& p, StageContext& context) {
  context.progress(0, "reading");
  const FitInputs inputs = read_inputs(context);
  const auto substrate = substrate::make_substrate(p.gel, p.substrate, context.threads);
  context.progress(0.05, "compliance of the substrate");
  LinearData data = reduce(inputs.beads, compliance_of(*substrate, inputs), beads_in_region(inputs, p.fit));
  context.progress(0.3, "spanning networks");
  const std::vector<network::CableNetwork> networks = span_ensemble(inputs, p, context.threads);
  const EnsembleFit fit = fit_ensemble(
      networks, data, adhesion_ids_of(inputs.cell), p.fit, context.threads,
      [&](double f, std::string_view what) { context.progress(0.4 + 0.5 * f, what); },
      p.fit.substrate == "per-evaluation" ? solved_misfit(*substrate, inputs, data) : SolvedMisfit{},
      start_of(context, networks.front().fibre_ids()));

  const std::vector<Tension> tensions = tensions_of(fit);
  const std::vector<AdhesionForce> forces = forces_of(fit, inputs.cell);
  const DisplacementField fitted = field_of(fit.forces_nN, inputs, data);
  FitSummary summary = summary_of(fit, data, inputs, networks, p.fit);
  const auto budget_start = std::chrono::steady_clock::now();
  summary.error_budget = budget_of(fit, data, networks, inputs, *substrate, p, context.threads);
  const double budget_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - budget_start).count();
  const std::vector<ModelScore> models = compare_models(fit, data, networks.front(), adhesion_ids_of(inputs.cell));
  const std::vector<FibreLeftOut> left_out = leave_each_fibre_out(fit, data);
  const std::vector<MissingFibre> missing = missing_fibres(fit, inputs.cell.adhesions);
  for (const auto& figure : figures_of(fit, models, left_out, missing)) summary.more.push_back(figure);
  write_correlations(context.output("out", "correlations.csv"), fit);
  write_models(context.output("out", "models.csv"), models);
  write_fibres_left_out(context.output("out", "fibres_left_out.csv"), left_out);
  write_missing_fibres(context.output("out", "missing_fibres.csv"), missing);
  const auto drawn = cross_validation_of(fit, data, networks.front(), inputs.cell, p.fit, context.threads);
  if (drawn) write_cross_validation(context.output("out", "cross_validation.csv"), *drawn);
  write_tensions(context.output("out", "tensions.csv"), tensions, inputs.cell.fibres);
  write_adhesion_forces(context.output("out", "adhesion_forces.csv"), forces, inputs.cell.adhesions);
  write_fit_summary(context.output("out", "fit.json"), summary, inputs.cell.fibres);
  write_contracted(context.output("out", "contracted.vtu"), networks.front(), fit);
  write_tractions_vtp(context.output("out", "tractions.vtp"), inputs.cell, forces);
  write_displacement(context.output("out", "fitted_displacement.csv"), fitted);
  write_displacement(context.output("out", "displacement_without_fibres.csv"),
                     field_of(models.front().forces_nN, inputs, data));
  write_displacement_vtp(context.output("out", "displacement.vtp"), inputs.beads, fitted,
                         {most_informed_array(fit, data), weight_array(data)});
  context.progress(0.95, "surface of the gel");
  write_surface(context.output("out", "substrate.vtu"), *substrate, inputs.cell, forces, p.fit.surface_lines);
  context.progress(1, "done");

  const auto n_unidentifiable =
      std::count_if(tensions.begin(), tensions.end(), [](const Tension& t) { return !t.identifiable; });
  StageReport report{.converged = fit.report.converged,
                     .summary = std::to_string(tensions.size() - 1) + " fibre tensions, total force " +
                                brief(summary.total_force_nN) + " nN, relative L2 " + brief(summary.relative_l2),
                     .figures = summary.more,
                     .effects = effects_of(*substrate, inputs, p.fit)};
  report.figures.emplace_back("error_budget_s", budget_s);
  const std::string together = names_of_groups(fit);
  if (!together.empty()) report.summary += "; not told apart, but their sum: fibres " + together;
  if (n_unidentifiable > 0) report.summary += "; " + std::to_string(n_unidentifiable) + " tensions not identifiable";
  if (inputs.n_flagged > 0) report.summary += "; " + std::to_string(inputs.n_flagged) + " flagged beads left out";
  if (!fit.report.converged) report.summary = fit.report.reason;
  if (data.has_errors && fit.chi_squared_per_degree > kPoorFit) {
    report.summary += "; the model explains the beads poorly (chi squared " + brief(fit.chi_squared_per_degree) +
                      " per degree of freedom): do displacement, segmentation and gel belong together?";
  }
  for (const auto& figure : substrate->figures()) report.figures.push_back(figure);
  return report;
}

}  // namespace
}  // namespace mbtfm::inverse

int main(int argc, char** argv) {
  using mbtfm::FileArgument;
  using namespace mbtfm::inverse;
  return mbtfm::run_stage<FitStageParameters>(
      {.name = "fit",
       .purpose = "find the tension of every stress fibre and the force of every adhesion from bead displacements",
       .files = {{"cell", FileArgument::Kind::input,
                  "folder with adhesions.csv, fibres.csv, fibre_points.csv, outline.csv"},
                 {"network", FileArgument::Kind::input, "network.vtu"},
                 {"displacement", FileArgument::Kind::input, "displacement.csv of the beads"},
                 {"start", FileArgument::Kind::optional_input, "tensions.csv to start from: of the frame before"},
                 {"out", FileArgument::Kind::output_folder, "tensions.csv, adhesion_forces.csv, fit.json, VTK files"}}},
      argc, argv, fit);
}
