#include "pipeline/cost/accuracy.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>

#include "pipeline/contract/errors.h"
#include "pipeline/files/json.h"
#include "pipeline/files/json_record.h"
#include "pipeline/files/text.h"

namespace mbtfm::cost {

namespace {

// Where computing could lower the error by no more than this share of it, more of it is in vain.
constexpr double kWorthwhile = 0.05;

std::string percent(double share) { return fmt::format("{:.2g} %", 100 * share); }

std::string verdict_of(double wanted, const AccuracyOutcome& outcome) {
  const RelativeError& e = outcome.reached;
  std::string text =
      fmt::format("tensions to {} (preset {}), {} asked for", percent(e.total), outcome.preset, percent(wanted));
  if (outcome.is_met) return text;
  if (e.unavoidable > wanted) {
    return text + fmt::format(
                      ": no computing reaches that, as by the error budget the beads' noise alone makes {} and the "
                      "segmentation {}, together {}; the model's misfit makes {}",
                      percent(e.beads), percent(e.segmentation), percent(e.unavoidable), percent(e.model));
  }
  return text + fmt::format(
                    ": the model's misfit ({}), the mesh and the gel stand in the way; finer meshes and gels than "
                    "those of the presets may reach it",
                    percent(e.model));
}

}  // namespace

RelativeError relative_error(const ErrorBudget& budget) {
  double tensions = 0, all = 0, beads = 0, segmentation = 0, model = 0;
  RelativeError error;
  for (const TensionError& t : budget.tensions) {
    if (t.fibre_id == 0) continue;
    const ErrorParts& p = t.parts_nN;
    tensions += t.tension_nN * t.tension_nN;
    all += std::pow(total(p), 2);
    beads += p.beads * p.beads + p.place.value_or(0) * p.place.value_or(0);  // of the same beads
    segmentation += p.segmentation * p.segmentation;
    model += p.model * p.model;
    error.is_complete = error.is_complete && p.mesh.has_value();
  }
  if (tensions <= 0) throw InvalidData("tensions", "a fibre that pulls, for a relative error", "none");
  error.total = std::sqrt(all / tensions);
  error.beads = std::sqrt(beads / tensions);
  error.segmentation = std::sqrt(segmentation / tensions);
  error.model = std::sqrt(model / tensions);
  error.unavoidable = std::hypot(error.beads, error.segmentation);
  return error;
}

double parse_accuracy(const std::string& text) {
  try {
    std::size_t end = 0;
    const double number = std::stod(text, &end);
    static const std::map<std::string, double> kUnits = {{"", 1}, {"%", 100}, {" %", 100}};
    const auto unit = kUnits.find(text.substr(end));
    const double share = unit == kUnits.end() ? 0 : number / unit->second;
    if (share > 0 && share < 1) return share;
  } catch (const std::logic_error&) {
    // said below
  }
  throw UsageError("--accuracy: expected a relative error as 1% or 0.01, found '" + text + "'");
}

AccuracyOutcome reach_accuracy(double wanted, const std::function<ErrorBudget(const std::string& preset)>& run) {
  AccuracyOutcome outcome;
  for (const Preset& preset : presets()) {
    outcome.preset = preset.name;
    outcome.reached = relative_error(run(preset.name));
    const RelativeError& e = outcome.reached;
    outcome.is_met = e.is_complete && e.total <= wanted;
    const bool is_in_vain = e.is_complete && e.unavoidable > wanted && e.total < (1 + kWorthwhile) * e.unavoidable;
    if (outcome.is_met || is_in_vain) break;
  }
  outcome.verdict = verdict_of(wanted, outcome);
  return outcome;
}

void record_accuracy(const std::filesystem::path& cell, double wanted, const AccuracyOutcome& outcome) {
  const std::filesystem::path file = cell / "run.json";
  nlohmann::ordered_json run =
      files::JsonRecord(file, "a run.json of mbtfm run", "delete it and run the cell again: mbtfm run").json();
  const RelativeError& e = outcome.reached;
  run["accuracy"] = {{"wanted", wanted},
                     {"reached", e.total},
                     {"unavoidable", e.unavoidable},
                     {"beads", e.beads},
                     {"segmentation", e.segmentation},
                     {"model", e.model},
                     {"met", outcome.is_met},
                     {"preset", outcome.preset},
                     {"verdict", outcome.verdict}};
  files::write_whole(file, files::json_text(run, 1) + "\n");
}

}  // namespace mbtfm::cost
