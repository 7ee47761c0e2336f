#include "pipeline/cost/study.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/report.h"
#include "pipeline/contract/results.h"
#include "pipeline/cost/accuracy.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/json_record.h"
#include "pipeline/files/own_files.h"
#include "pipeline/report/compare.h"
#include "pipeline/report/space_results.h"
#include "pipeline/runner/cell_stages.h"
#include "pipeline/runner/process.h"
#include "pipeline/runner/run_cell.h"

namespace mbtfm::cost {
namespace {

double median(std::vector<double> values) {
  std::ranges::sort(values);
  const std::size_t n = values.size();
  return n == 0 ? 0 : 0.5 * (values[(n - 1) / 2] + values[n / 2]);
}

/// What one run took, and how it ended.
struct Run {
  double seconds = 0, cpu_seconds = 0, peak_memory_MB = 0;
  std::string failure = {};

  void add(const Run& other) {
    seconds += other.seconds;
    cpu_seconds += other.cpu_seconds;
    peak_memory_MB = std::max(peak_memory_MB, other.peak_memory_MB);
    failure = other.failure;
  }
};

struct Answer {
  std::vector<Fibre> fibres = {};
  std::map<int, double> tensions_nN = {};  ///< of the fibres
  double total_force_nN = 0;
  std::optional<report::SpaceMap> map = {};  ///< of a cell in space, in place of the fibres
};

bool is_from_images(const runner::Stage& stage) { return !stage.images.empty(); }

/// All that segmentation and tracking read is there.
bool has_all_images(const fs::path& cell, const runner::ImageNames& names) {
  for (const runner::Stage& stage : runner::stages()) {
    for (const runner::ImageInput& image : runner::images_of(stage, names))
      if (runner::match_image(cell, runner::name_of_image(names, image.key)).files.size() != 1) return false;
  }
  return true;
}

/// The files of a folder, without what lies in folders below it.
void copy_files(const fs::path& from, const fs::path& to) {
  fs::create_directories(to);
  for (const fs::directory_entry& entry : fs::directory_iterator(from))
    if (files::is_own_file(entry.path())) fs::copy_file(entry.path(), to / entry.path().filename());
}

/// A folder that looks like the cell, whose stages are rerun by each rung.
class Scratch {
 public:
  Scratch(const fs::path& cell, const StudyOptions& options)
      : options_(options),
        cell_(cell),
        folder_(files::inside(cell, "cost/scratch", cell.string())),  // it is emptied
        images_(runner::read_image_names(cell)) {
    files::check_cell_folder(cell);
    const runner::CellStages of = runner::stages_of(cell, images_);
    kind_ = of.kind;
    if (is_sheet(kind_))
      throw InputError(cell.string(),
                       "a cell with fibres on a flat gel, or one in space: the knobs that are turned are theirs",
                       "a sheet (" + of.why + ")",
                       "its report lists how long each stage took; sheet.mesh_um sets how many triangles there are");
    stages_ = runner::stages();
    if (!has_fibres(kind_))
      stages_ = {of.stages.back()};  // traction
    else
      has_images_ = has_all_images(cell, images_);
    for (runner::Stage& stage : stages_)  // of a time series the first frame alone is fitted
      std::erase_if(stage.arguments, [](const auto& a) { return a.given == runner::PathArgument::Given::if_series; });
    for (const std::string& file : needed()) {
      if (files::is_file(cell / file)) continue;
      throw InputError((cell / file).string(), "a cell whose images were segmented and tracked", "none",
                       "run it first: mbtfm run " + cell.string());
    }
    fs::remove_all(folder_);
    fs::create_directories(folder_);
    fs::copy_file(cell / "cell.toml", folder_ / "cell.toml");
    if (files::is_folder(cell / "truth")) copy_files(cell / "truth", folder_ / "truth");
    take_from_cell();
  }
  ~Scratch() {
    std::error_code ignored;
    fs::remove_all(folder_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;

  CellKind kind() const { return kind_; }
  const fs::path& folder() const { return folder_; }
  bool has_images() const { return has_images_; }

  /// Segmentation and tracking run where they are not as the cell has them; else what they took of late counts.
  Run run(const Rung& rung) {
    const bool is_own = !has_images_ || !needs_images(rung), is_timed = rung.knob == kAsItIs;
    Run run = of_images_;
    if (has_images_ && (!is_own || is_timed || rung.threads)) run = run_stages(rung, true);
    if (is_timed) of_images_ = run;
    if (run.failure.empty()) {
      if (is_own) take_from_cell();  // it may have files that were mended by hand
      take_share_of_beads(rung.bead_share);
      run.add(run_stages(rung, false));
    }
    return run;
  }

  Answer answer() const {
    Answer answer;
    if (!has_fibres(kind_)) {
      answer.map = report::map_of(report::read_space_results(folder_));
      answer.total_force_nN = answer.map->total_force_nN;
      return answer;
    }
    answer.fibres = files::read_cell(folder_ / "1_segment").fibres;
    for (const Tension& t : files::read_tensions(folder_ / "4_fit/tensions.csv"))
      if (t.fibre_id != 0) answer.tensions_nN[t.fibre_id] = t.tension_nN;
    answer.total_force_nN = files::read_fit_summary(folder_ / "4_fit/fit.json").total_force_nN;
    return answer;
  }

 private:
  /// Without which the cell was not run.
  std::vector<std::string> needed() const {
    if (is_in_space(kind_))
      return {report::kBeadsInSpace, "3_surface/surface.vtp", "4_traction/traction.json", "cell.toml"};
    return {"1_segment/adhesions.csv", "2_track/displacement.csv", "cell.toml"};
  }

  void take_from_cell() const {
    std::vector<std::string> parts = {"1_segment", "2_track"};
    if (is_in_space(kind_)) parts.emplace_back("3_surface");
    for (const std::string& part : parts) {
      fs::remove_all(folder_ / part);
      if (files::is_folder(cell_ / part)) copy_files(cell_ / part, folder_ / part);
    }
    if (!has_fibres(kind_)) fs::create_directories(folder_ / "4_traction");
  }

  /// Every so-manieth bead, so that they stay evenly spread in whatever order they come.
  void take_share_of_beads(double share) const {
    if (share >= 1) return;
    const auto some_of = [share](const auto& beads) {
      std::remove_cvref_t<decltype(beads)> some;
      double sum = 0;
      for (const auto& bead : beads) {
        sum += share;
        if (sum < 1) continue;
        sum -= 1;
        some.push_back(bead);
      }
      return some;
    };
    if (is_in_space(kind_)) {
      const fs::path file = folder_ / report::kBeadsInSpace;
      files::write_displacement_in_space(file, some_of(files::read_displacement_in_space(file)));
    } else {
      const fs::path file = folder_ / "2_track/displacement.csv";
      files::write_displacement(file, some_of(files::read_displacement(file)));
    }
  }

  Run run_stages(const Rung& rung, bool from_images) const {
    Run run;
    for (const runner::Stage& stage : stages_) {
      if (!run.failure.empty() || is_from_images(stage) != from_images) continue;
      const runner::ProcessResult result = runner::run_process(command_of(stage, rung), {}, [](std::string_view) {});
      const bool is_answer = !result.signal && (result.exit_code == 0 || result.exit_code == exit_code::kNotSolved);
      run.add({.seconds = result.seconds,
               .cpu_seconds = result.cpu_seconds,
               .peak_memory_MB = result.peak_memory_MB,
               .failure = is_answer ? "" : stage.name + ": " + runner::how_it_ended(result)});
    }
    return run;
  }

  std::vector<std::string> command_of(const runner::Stage& stage, const Rung& rung) const {
    std::vector<std::string> command = runner::command_of(stage, options_.stage_folder, cell_, folder_, images_,
                                                          rung.threads.value_or(options_.threads));
    command.emplace_back("--quiet");
    for (const std::string& flag : runner::flags_of(stage, rung.settings)) command.push_back(flag);
    return command;
  }

  const StudyOptions& options_;
  fs::path cell_, folder_;
  runner::ImageNames images_;
  CellKind kind_ = {};
  std::vector<runner::Stage> stages_;  ///< that are run
  bool has_images_ = false;
  Run of_images_;  ///< segmentation and tracking as the cell has them
};

void compare(Measurement& m, const Answer& answer, const Answer& reference) {
  m.force_error = std::abs(answer.total_force_nN / reference.total_force_nN - 1);
  if (answer.map) {
    m.error = difference(*answer.map, *reference.map);
    m.stated_error = answer.map->stated_error.value_or(0);
    return;
  }
  double error = 0, size = 0;
  for (const auto& [id, tension_nN] : answer.tensions_nN) {
    const auto found = reference.tensions_nN.find(id);
    if (found == reference.tensions_nN.end()) continue;
    ++m.n_fibres;
    error += std::pow(tension_nN - found->second, 2);
    size += std::pow(found->second, 2);
  }
  m.error = size > 0 ? std::sqrt(error / size) : 0;
}

/// The finest that the ladder's knobs allow, all at once, within reason.
Rung finest(CellKind kind, double spacing_um) {
  if (!has_fibres(kind)) {
    constexpr double kFinest = 0.7;
    return {.knob = "reference",
            .value = "tractions " + brief(kFinest * spacing_um) + " um apart, gel to 0.5 %",
            .settings = {{"traction", "spacing_um", shortest(kFinest * spacing_um)},
                         {"substrate", "displacement_tolerance", "0.005"}}};
  }
  static const Rung rung = {.knob = "reference",
                            .value = "32 meshes of 1 um",
                            .settings = {{"fit", "n_meshes", "32"}, {"network", "edge_length_um", "1"}}};
  return rung;
}

/// True tensions by the segmentation's fibre.
Answer truth_of(const fs::path& cell, CellKind kind) {
  if (!has_fibres(kind)) {
    const report::SpaceMap map = report::true_space_map(cell);
    return {.tensions_nN = {}, .total_force_nN = map.total_force_nN, .map = map};
  }
  const report::Comparison comparison = report::compare_with_truth(cell);
  Answer truth;
  for (const report::ComparedFibre& fibre : comparison.fibres)
    if (fibre.found && fibre.true_tension_nN) truth.tensions_nN[fibre.found->fibre_id] = *fibre.true_tension_nN;
  truth.total_force_nN = comparison.true_total_force_nN.value_or(comparison.total_force_nN);
  return truth;
}

/// The reference's tensions by the fibres of another segmentation; a map as it is.
Answer by_fibres_of(const Answer& answer, const Answer& reference) {
  if (reference.map) return reference;
  Answer result{.fibres = answer.fibres, .total_force_nN = reference.total_force_nN};
  for (const report::FibreMatch& match : report::match_fibres(answer.fibres, reference.fibres)) {
    const int found_id = answer.fibres[match.found_index].fibre_id;
    const int id = reference.fibres[match.true_index].fibre_id;
    if (reference.tensions_nN.contains(id)) result.tensions_nN[found_id] = reference.tensions_nN.at(id);
  }
  return result;
}

double median_of(const std::vector<Run>& runs, double Run::*value) {
  std::vector<double> values;
  for (const Run& run : runs) values.push_back(run.*value);
  return median(std::move(values));
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
  Scratch scratch(cell, options);
  const bool of_fibres = has_fibres(scratch.kind());
  Study study{.kind = scratch.kind(), .reference = "the truth", .has_images = scratch.has_images()};
  const double spacing_um =
      of_fibres ? 0
                : files::JsonRecord(cell / "4_traction/traction.json", "a summary as mbtfm-traction writes it")
                      .at("spacing_x_um")
                      .number();
  for (Rung& rung : of_fibres ? ladder(options.extent) : ladder_in_space(options.extent, spacing_um))
    if (scratch.has_images() || rung.knob == kPreset || !needs_images(rung))
      study.measurements.push_back({.rung = std::move(rung)});
  std::vector<std::vector<Run>> runs(study.measurements.size());
  std::optional<Answer> finest_answer;
  if (!(of_fibres ? report::has_truth(cell) : report::has_space_truth(cell))) {
    const Rung rung = finest(scratch.kind(), spacing_um);
    study.reference = rung.value;
    say("reference: " + study.reference);
    const Run run = scratch.run(rung);
    if (!run.failure.empty()) throw NotSolved({.reason = "the reference failed: " + run.failure});
    finest_answer = scratch.answer();
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
      const Answer answer = scratch.answer();
      compare(m, answer,
              finest_answer ? by_fibres_of(answer, *finest_answer) : truth_of(scratch.folder(), scratch.kind()));
      if (of_fibres) {
        const auto budget = files::read_fit_summary(scratch.folder() / "4_fit/fit.json").error_budget;
        if (budget && m.error > 0) m.stated_error = relative_error(*budget).total;
      }
      say(fmt::format("{} of {}: {} {}: {:.1f} s, error {:.3f}", i + 1, runs.size(), m.rung.knob, m.rung.value,
                      run.seconds, m.error));
    }
  }
  for (std::size_t i = 0; i < runs.size(); ++i) {
    study.measurements[i].seconds = median_of(runs[i], &Run::seconds);
    study.measurements[i].cpu_seconds = median_of(runs[i], &Run::cpu_seconds);
    study.measurements[i].peak_memory_MB = median_of(runs[i], &Run::peak_memory_MB);
  }
  return study;
}

Study combined(const std::vector<Study>& studies) {
  if (std::ranges::any_of(studies, [&](const Study& s) { return s.kind != studies.front().kind; }))
    throw UsageError("cells with fibres and cells in space have different knobs: give them in two studies");
  Study all = studies.front();
  const auto n = static_cast<double>(studies.size());
  for (std::size_t i = 0; i < all.measurements.size(); ++i) {
    Measurement& m = all.measurements[i];
    double tensions = 0, forces = 0, stated = 0;
    m.seconds = m.cpu_seconds = m.peak_memory_MB = 0;
    m.n_fibres = 0;
    for (const Study& study : studies) {
      const auto same = std::ranges::find_if(study.measurements, [&](const Measurement& o) {
        return o.rung.knob == m.rung.knob && o.rung.value == m.rung.value;
      });
      const Measurement of_cell = same == study.measurements.end() ? Measurement{.rung = m.rung} : *same;
      m.n_runs = std::min(m.n_runs, of_cell.n_runs);
      if (m.failure.empty()) m.failure = of_cell.failure;
      m.n_fibres += of_cell.n_fibres;
      m.seconds += of_cell.seconds / n;
      m.cpu_seconds += of_cell.cpu_seconds / n;
      m.peak_memory_MB = std::max(m.peak_memory_MB, of_cell.peak_memory_MB);
      tensions += std::pow(of_cell.error, 2) / n;
      forces += std::pow(of_cell.force_error, 2) / n;
      stated += std::pow(of_cell.stated_error, 2) / n;
    }
    m.error = std::sqrt(tensions);
    m.force_error = std::sqrt(forces);
    m.stated_error = std::sqrt(stated);
  }
  return all;
}

}  // namespace mbtfm::cost
