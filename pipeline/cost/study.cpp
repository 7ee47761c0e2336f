#include "pipeline/cost/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/files.h"
#include "pipeline/cost/accuracy.h"
#include "pipeline/report/compare.h"
#include "pipeline/runner/process.h"

namespace mbtfm::cost {
namespace fs = std::filesystem;
namespace {

double median(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  const std::size_t n = values.size();
  return n == 0 ? 0 : 0.5 * (values[(n - 1) / 2] + values[n / 2]);
}

/// What one run found and took.
struct Run {
  double seconds = 0, cpu_seconds = 0, peak_memory_MB = 0;
  std::string failure;
};

struct Answer {
  std::map<int, double> tensions_nN;  ///< of the fibres
  double total_force_nN = 0;
};

/// A folder that looks like the cell, whose network and fit are made anew by each rung.
class Scratch {
 public:
  Scratch(const fs::path& cell, const StudyOptions& options) : options_(options), folder_(cell / "cost/scratch") {
    for (const char* file : {"1_segment/adhesions.csv", "2_track/displacement.csv", "cell.toml"}) {
      if (fs::is_regular_file(cell / file)) continue;
      throw InputError((cell / file).string(), "a cell whose images were segmented and tracked", "none",
                       "run it first: mbtfm run " + cell.string());
    }
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    for (const char* part : {"1_segment", "2_track", "truth"}) {
      if (fs::is_directory(cell / part)) fs::copy(cell / part, folder_ / part, fs::copy_options::recursive);
    }
    fs::copy(cell / "cell.toml", folder_ / "cell.toml");
    beads_ = read_displacement(folder_ / "2_track/displacement.csv");
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  const fs::path& folder() const { return folder_; }

  Run run(const Rung& rung) const {
    write_beads(rung.bead_share);
    Run run;
    for (const runner::Stage& stage : runner::stages()) {
      if (!run.failure.empty() || (stage.name != "network" && stage.name != "fit")) continue;
      const runner::ProcessResult result = runner::run_process(command_of(stage, rung), {}, [](std::string_view) {});
      run.seconds += result.seconds;
      run.cpu_seconds += result.cpu_seconds;
      run.peak_memory_MB = std::max(run.peak_memory_MB, result.peak_memory_MB);
      const bool is_answer = !result.signal && (result.exit_code == 0 || result.exit_code == exit_code::kNotSolved);
      if (!is_answer) run.failure = stage.name + ": " + runner::how_it_ended(result);
    }
    return run;
  }

  Answer answer() const {
    Answer answer;
    for (const Tension& t : read_tensions(folder_ / "4_fit/tensions.csv")) {
      if (t.fibre_id != 0) answer.tensions_nN[t.fibre_id] = t.tension_nN;
    }
    answer.total_force_nN = read_fit_summary(folder_ / "4_fit/fit.json").total_force_nN;
    return answer;
  }

 private:
  /// Every so-manieth bead, so that they stay evenly spread in whatever order they come.
  void write_beads(double share) const {
    DisplacementField some;
    double sum = 0;
    for (const Bead& bead : beads_) {
      sum += share;
      if (sum < 1) continue;
      sum -= 1;
      some.push_back(bead);
    }
    write_displacement(folder_ / "2_track/displacement.csv", some);
  }

  std::vector<std::string> command_of(const runner::Stage& stage, const Rung& rung) const {
    std::vector<std::string> command = {(options_.stage_folder / ("mbtfm-" + stage.name)).string()};
    const auto add = [&](const std::string& flag, const std::string& value) {
      command.push_back("--" + flag);
      command.push_back(value);
    };
    for (const runner::PathArgument& argument : stage.arguments) {
      if (argument.where.empty()) add(argument.flag, (folder_ / argument.path).string());  // else: of a time series
    }
    add("config", (folder_ / "cell.toml").string());
    add(stage.output.flag, (folder_ / stage.output.path).string());
    add("threads", std::to_string(rung.threads.value_or(options_.threads)));
    command.emplace_back("--quiet");
    for (const std::string& flag : runner::flags_of(stage, rung.settings)) command.push_back(flag);
    return command;
  }

  const StudyOptions& options_;
  fs::path folder_;
  DisplacementField beads_;
};

void compare(Measurement& m, const Answer& answer, const Answer& reference) {
  double error = 0, size = 0;
  for (const auto& [id, tension_nN] : answer.tensions_nN) {
    const auto found = reference.tensions_nN.find(id);
    if (found == reference.tensions_nN.end()) continue;
    error += std::pow(tension_nN - found->second, 2);
    size += std::pow(found->second, 2);
  }
  m.tension_error = size > 0 ? std::sqrt(error / size) : 0;
  m.force_error = std::abs(answer.total_force_nN / reference.total_force_nN - 1);
}

/// The finest that the ladder's knobs allow, all at once, within reason.
const Rung& finest() {
  static const Rung rung = {
      .knob = "reference",
      .value = "32 meshes of 1 um",
      .settings = {
          {"fit", "n_meshes", "32"}, {"network", "edge_length_um", "1"}, {"substrate", "cells_per_thickness", "3"}}};
  return rung;
}

/// True tensions by the segmentation's fibre.
Answer truth_of(const fs::path& cell) {
  const report::Comparison comparison = report::compare_with_truth(cell);
  Answer truth;
  for (const report::ComparedFibre& fibre : comparison.fibres) {
    if (fibre.found && fibre.true_tension_nN) truth.tensions_nN[fibre.found->fibre_id] = *fibre.true_tension_nN;
  }
  truth.total_force_nN = comparison.true_total_force_nN.value_or(comparison.total_force_nN);
  return truth;
}

}  // namespace

Study measure(const fs::path& cell, const StudyOptions& options) {
  const auto start = std::chrono::steady_clock::now();
  const auto is_over = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() > options.budget_s;
  };
  const auto say = [&](const std::string& text) {
    if (options.say) options.say(text);
  };
  const Scratch scratch(cell, options);
  Study study;
  for (Rung& rung : ladder(options.extent)) study.measurements.push_back({.rung = std::move(rung)});
  std::vector<std::vector<Run>> runs(study.measurements.size());
  std::optional<Answer> reference;
  study.reference = "the truth";
  if (!report::has_truth(cell)) {
    study.reference = finest().value;
    say("reference: " + study.reference);
    const Run run = scratch.run(finest());
    if (!run.failure.empty()) throw NotSolved({.reason = "the reference failed: " + run.failure});
    reference = scratch.answer();
  }
  for (int repeat = 0; repeat < options.repeats; ++repeat) {
    for (std::size_t i = 0; i < runs.size() && !is_over(); ++i) {
      Measurement& m = study.measurements[i];
      if (!m.failure.empty()) continue;
      const Run run = scratch.run(m.rung);
      ++m.n_runs;
      m.failure = run.failure;
      runs[i].push_back(run);
      if (repeat > 0 || !run.failure.empty()) continue;
      if (!reference) reference = truth_of(scratch.folder());
      compare(m, scratch.answer(), *reference);
      const auto budget = read_fit_summary(scratch.folder() / "4_fit/fit.json").error_budget;
      if (budget && m.tension_error > 0) m.stated_error = relative_error(*budget).total;
      say(fmt::format("{} of {}: {} {}: {:.1f} s, error {:.3f}", i + 1, runs.size(), m.rung.knob, m.rung.value,
                      run.seconds, m.tension_error));
    }
  }
  for (std::size_t i = 0; i < runs.size(); ++i) {
    std::vector<double> seconds, cpu, memory;
    for (const Run& run : runs[i]) {
      seconds.push_back(run.seconds);
      cpu.push_back(run.cpu_seconds);
      memory.push_back(run.peak_memory_MB);
    }
    study.measurements[i].seconds = median(seconds);
    study.measurements[i].cpu_seconds = median(cpu);
    study.measurements[i].peak_memory_MB = median(memory);
  }
  return study;
}

}  // namespace mbtfm::cost
