/// mbtfm-simulate: a synthetic experiment with known truth.
#include <string_view>

#include "pipeline/stage/stage.h"
#include "samples/experiment/cell_folder.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::experiment;

/// The scenario named on the command line: its file sets the values that all other flags override.
std::string scenario_named(int argc, char** argv, const std::string& otherwise) {
  constexpr std::string_view kFlag = "--scenario";
  std::string name = otherwise;
  for (int i = 1; i < argc; ++i) {
    const std::string_view argument = argv[i];
    if (argument == kFlag && i + 1 < argc) name = argv[i + 1];
    if (argument.starts_with("--scenario=")) name = argument.substr(kFlag.size() + 1);
  }
  return name;
}

/// Images beside the true segmentation of an earlier experiment would never be looked at: it would pass for the user's.
void refuse_given_segmentation(const std::filesystem::path& cell) {
  if (std::filesystem::exists(cell / "1_segment") && !std::filesystem::exists(cell / "run.json")) {
    throw UsageError(cell.string() + " holds an experiment without images: choose another folder or remove it");
  }
}

StageReport run(const drawing::ScenarioParameters& parameters, stage::StageContext& context) {
  if (parameters.images) refuse_given_segmentation(context.outputs_.at("out"));
  const Work work(context.threads, context.progress);
  const experiment::Experiment experiment = experiment::simulate(parameters, work);
  const auto file = [&](const std::string& name) { return context.output("out", name); };
  experiment::write_cell_folder(experiment, parameters, file);
  if (parameters.images) experiment::write_images(experiment, parameters, file, work);
  StageReport report;
  report.figures = {{"n_adhesions", static_cast<std::int64_t>(experiment.cell.adhesions.size())},
                    {"n_fibres", static_cast<std::int64_t>(experiment.cell.fibres.size())},
                    {"n_vertices", static_cast<std::int64_t>(experiment.network.vertices_um.size())},
                    {"total_force_nN", experiment.total_force_nN},
                    {"largest_displacement_um", experiment.largest_displacement_um},
                    {"noise_um", experiment.noise_um}};
  const auto rounded = [](double value) {
    char text[32];
    std::snprintf(text, sizeof text, "%.3g", value);
    return std::string(text);
  };
  report.summary = parameters.scenario + ": " + std::to_string(experiment.cell.adhesions.size()) + " adhesions, " +
                   std::to_string(experiment.cell.fibres.size()) + " fibres, total force " +
                   rounded(experiment.total_force_nN) + " nN, largest displacement " +
                   rounded(experiment.largest_displacement_um) + " um, noise " + rounded(experiment.noise_um) + " um";
  return report;
}

}  // namespace

int main(int argc, char** argv) {
  using namespace mbtfm;
  drawing::ScenarioParameters parameters;
  return stage::run_stage(
      {.name = "simulate",
       .purpose = "simulate a traction force microscopy experiment with known truth",
       .files = {{"out", stage::FileArgument::Kind::output_folder, "cell folder to write"}}},
      argc, argv,
      [&](stage::ParameterList& list) {
        declare(list, parameters);
        stage::read_toml(list, drawing::scenario_file(scenario_named(argc, argv, parameters.scenario)));
      },
      [&](stage::StageContext& context) { return run(parameters, context); });
}
