/// mbtfm-simulate: a synthetic experiment with known truth.
#include <string_view>

#include "pipeline/contract/numbers.h"
#include "pipeline/contract/parsed.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"
#include "samples/colonies/colony.h"
#include "samples/colonies/folder.h"
#include "samples/drawing/rough_day.h"
#include "samples/experiment/cell_folder.h"
#include "samples/gels/folder.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::experiment;

/// What the command line says of a flag, before all flags are read: the last one counts.
std::optional<std::string> value_of(const std::string& flag, int argc, char** argv) {
  std::optional<std::string> value;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == flag && i + 1 < argc) value = argv[i + 1];
    if (argument.starts_with(flag + "=")) value = argument.substr(flag.size() + 1);
  }
  return value;
}

/// The scenario's file, then a rough day's faults set the values that all other flags override.
void set_scenario(stage::ParameterList& list, drawing::ScenarioParameters& cell, int argc, char** argv) {
  stage::read_toml(list, drawing::scenario_file(value_of("--scenario", argc, argv).value_or(cell.scenario)));
  const std::optional<std::string> rough = value_of("--rough", argc, argv);
  if (!rough) return;
  if (const int number = parsed<int>(*rough).value_or(0); number > 0) cell = drawing::rough_day(cell, number);
}

struct SimulateParameters {
  bool force = false;  ///< what an earlier simulation made is written over
  drawing::ScenarioParameters cell;
  gels::SpaceParameters space;
  colonies::ColonyParameters colony;
  sheet::SheetParameters sheet;
};

void declare(stage::ParameterList& list, SimulateParameters& p) {
  declare(list, p.cell);
  list.add("force", p.force);
  declare(list, p.space);
  declare(list, p.colony);
  declare(list, p.sheet);
}

/// A cell on a gel in space.
StageReport run_in_space(const SimulateParameters& p, stage::StageContext& context) {
  const gels::GelScene scene = gels::simulate(p.space, gels::size_of(p.cell), context.threads, context.progress);
  const auto file = [&](const std::string& name) { return context.output("out", name); };
  gels::write_folder(scene, p.space, p.cell, file);
  if (p.cell.images) gels::write_stacks(scene, p.space, p.cell, file, context.threads, context.progress);
  return gels::report_of(scene, p.space.scene);
}

/// Below the output: the folder itself where there is one colony, else colony_001 and so on.
std::string folder_of_colony(int k, int n) {
  std::string number = std::to_string(k + 1);
  number.insert(0, std::max<std::size_t>(3, number.size()) - number.size(), '0');
  return n == 1 ? "" : "colony_" + number + "/";
}

StageReport run_colonies(const SimulateParameters& p, stage::StageContext& context) {
  const int n = p.colony.n_colonies;
  for (int k = 0; k < n; ++k) expect_simulated(context.outputs_.at("out") / folder_of_colony(k, n));
  const Work work(context.threads, context.progress);
  const colonies::Contracting contracting(p.colony, p.sheet, p.cell, work.part(0, 0.5));
  double largest_um = 0, noise_um = 0;
  std::size_t n_beads = 0;
  for (int k = 0; k < n; ++k) {
    const std::string folder = folder_of_colony(k, n);
    const auto file = [&](const std::string& name) { return context.output("out", folder + name); };
    work.tell(0.5 + 0.5 * k / n, "colony " + std::to_string(k + 1) + " of " + std::to_string(n));
    const colonies::Colony colony = contracting.colony(k);
    colonies::Whole whole{p.cell, p.colony, p.sheet};
    whole.scenario.seed = colonies::seed_of(p.cell, k);
    colonies::write_folder(colony, contracting.solution(), whole, file);
    if (p.cell.images) colonies::write_images(colony, whole.scenario, file, {context.threads});
    largest_um = std::max(largest_um, colony.largest_displacement_um);
    noise_um = std::max(noise_um, colony.noise_um);
    n_beads += colony.measured.size();
  }
  const sheet::Balance balance = sheet::balance_of(contracting.solution());
  StageReport report;
  report.figures = {{"n_colonies", std::int64_t{n}},
                    {"n_beads", static_cast<std::int64_t>(n_beads)},
                    {"total_force_nN", balance.total_force_nN},
                    {"mean_tension_nN_per_um", balance.mean_tension_nN_per_um},
                    {"largest_displacement_um", largest_um},
                    {"noise_um", noise_um}};
  report.summary = p.cell.scenario + ": " + std::to_string(n) + (n == 1 ? " colony on " : " colonies on ") +
                   (contracting.is_on_gel() ? "a gel" : "springs") + ", total force " + brief(balance.total_force_nN) +
                   " nN, mean tension " + brief(balance.mean_tension_nN_per_um) + " nN/um, largest displacement " +
                   brief(largest_um) + " um, noise " + brief(noise_um) + " um";
  return report;
}

/// Fields of gels in space are exact ones of linear elasticity, and sheets pull at a linear gel.
void refuse_large_strain(const SimulateParameters& p) {
  const bool is_flat_cell = p.colony.shape == colonies::Shape::none && p.space.scene == gels::SpaceScene::none;
  if (!is_flat_cell && p.cell.mechanics.simulation_material != MaterialLaw::linear)
    throw UsageError("expected simulation_material = linear with the scenario " + p.cell.scenario + ", found " +
                     name_of(p.cell.mechanics.simulation_material) + ": its gel is simulated with small strains only");
}

StageReport run(const SimulateParameters& all, stage::StageContext& context) {
  const drawing::ScenarioParameters& parameters = all.cell;
  refuse_large_strain(all);
  context.assumed.clear();  // of what it chooses itself nothing is assumed
  if (!all.force) context.remedy_to_replace = "--force writes over a simulated cell; else name a new folder";
  if (all.colony.shape != colonies::Shape::none) return run_colonies(all, context);
  expect_simulated(context.outputs_.at("out"));
  if (parameters.images) refuse_given_segmentation(context.outputs_.at("out"));
  if (all.space.scene != gels::SpaceScene::none) return run_in_space(all, context);
  const Work work(context.threads, context.progress);
  const experiment::Experiment experiment = experiment::simulate(parameters, work);
  const auto file = [&](const std::string& name) { return context.output("out", name); };
  experiment::write_cell_folder(experiment, parameters, file);
  if (parameters.images) experiment::write_images(experiment, parameters, file, work);
  return experiment::report_of(experiment, parameters.scenario);
}

}  // namespace

int main(int argc, char** argv) {
  using namespace mbtfm;
  SimulateParameters parameters;
  return stage::run_stage(
      {.name = "simulate", .files = {{"out", stage::FileArgument::Kind::output_folder}}}, argc, argv,
      [&](stage::ParameterList& list) {
        declare(list, parameters);
        set_scenario(list, parameters.cell, argc, argv);
      },
      [&](stage::StageContext& context) { return run(parameters, context); });
}
