#include "pipeline/statistics/study.h"

#include <algorithm>
#include <map>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/runner/batch.h"
#include "pipeline/statistics/rank_tests.h"

namespace mbtfm::statistics {
namespace fs = std::filesystem;
namespace {

using Groups = std::map<FibreType, std::vector<double>>;

Groups tensions_by_type(const std::vector<MeasuredFibre>& fibres) {
  Groups groups;
  for (const MeasuredFibre& f : fibres) groups[f.fibre->type].push_back(f.tension->tension_nN);
  return groups;
}

/// The median of each type in each cell.
Groups medians_by_type(const std::vector<MeasuredFibre>& fibres) {
  std::map<std::pair<FibreType, std::string>, std::vector<double>> by_cell;
  for (const MeasuredFibre& f : fibres) by_cell[{f.fibre->type, f.cell->name}].push_back(f.tension->tension_nN);
  Groups groups;
  for (const auto& [key, values] : by_cell) groups[key.first].push_back(describe(values).median);
  return groups;
}

TypeSummary summarise(const std::string& cell, FibreType type, int n_cells, const std::vector<double>& tensions_nN,
                      const StudyParameters& parameters) {
  const Description d = describe(tensions_nN);
  return {.cell = cell,
          .type = type,
          .n_cells = n_cells,
          .n_fibres = d.n,
          .mean_nN = d.mean,
          .median_nN = d.median,
          .sd_nN = d.standard_deviation,
          .fraction_above_weak = fraction_above(tensions_nN, parameters.weak_tension_nN),
          .fraction_above_strong = fraction_above(tensions_nN, parameters.strong_tension_nN)};
}

bool are_all_equal(const std::vector<double>& a, const std::vector<double>& b) {
  const auto is_first = [&](double v) { return v == a.front(); };
  return std::all_of(a.begin(), a.end(), is_first) && std::all_of(b.begin(), b.end(), is_first);
}

void add_tests(const Groups& groups, Unit unit, std::vector<TypeTest>& tests) {
  std::vector<std::pair<FibreType, std::vector<double>>> usable;
  for (const auto& [type, values] : groups) {
    if (values.size() >= 2) usable.emplace_back(type, values);
  }
  if (usable.size() < 2) return;
  std::vector<std::vector<double>> all;
  int n = 0;
  for (const auto& [type, values] : usable) {
    all.push_back(values);
    n += static_cast<int>(values.size());
  }
  if (std::all_of(all.begin(), all.end(), [&](const auto& group) { return are_all_equal(all.front(), group); })) return;
  const TestResult h = kruskal_wallis(all);
  tests.push_back({.test = "Kruskal-Wallis",
                   .unit = unit,
                   .group_a = "all types",
                   .group_b = {},
                   .n_a = n,
                   .n_b = 0,
                   .statistic = h.statistic,
                   .p_value = h.p_value,
                   .p_holm = {},
                   .effect = h.statistic / (n - 1)});
  const std::size_t first_pair = tests.size();
  std::vector<double> p_values;
  for (std::size_t i = 0; i < usable.size(); ++i) {
    for (std::size_t k = i + 1; k < usable.size(); ++k) {
      const auto& [type_a, a] = usable[i];
      const auto& [type_b, b] = usable[k];
      if (are_all_equal(a, b)) continue;
      const TestResult u = mann_whitney(a, b);
      const double n_pairs = static_cast<double>(a.size()) * static_cast<double>(b.size());
      tests.push_back({.test = "Mann-Whitney",
                       .unit = unit,
                       .group_a = std::string(name_of(type_a)),
                       .group_b = std::string(name_of(type_b)),
                       .n_a = static_cast<int>(a.size()),
                       .n_b = static_cast<int>(b.size()),
                       .statistic = u.statistic,
                       .p_value = u.p_value,
                       .p_holm = {},
                       .effect = 2 * u.statistic / n_pairs - 1});
      p_values.push_back(u.p_value);
    }
  }
  const std::vector<double> corrected = holm(p_values);
  for (std::size_t i = 0; i < corrected.size(); ++i) tests[first_pair + i].p_holm = corrected[i];
}

}  // namespace

void declare(ParameterList& list, StudyParameters& parameters) {
  list.table("stats");
  list.add("weak_tension_nN", parameters.weak_tension_nN, Range::positive(),
           "the share of fibres above this tension is given (nN)");
  list.add("strong_tension_nN", parameters.strong_tension_nN, Range::positive(),
           "the share of fibres above this tension is given, too (nN)");
}

const std::vector<std::string>& files_of_a_cell() {
  static const std::vector<std::string> files = {
      "1_segment/adhesions.csv", "1_segment/fibres.csv", "1_segment/fibre_points.csv",
      "1_segment/outline.csv",   "4_fit/tensions.csv",   "4_fit/adhesion_forces.csv",
      "4_fit/fit.json"};
  return files;
}

Study read_study(const Path& folder) {
  Study study;
  for (const Path& cell : runner::find_cells(folder)) {
    std::string name = cell.lexically_relative(folder).generic_string();
    if (name == ".") name = fs::weakly_canonical(cell).filename().string();
    const auto& files = files_of_a_cell();
    if (!std::all_of(files.begin(), files.end(), [&](const auto& file) { return fs::is_regular_file(cell / file); })) {
      study.unfinished.push_back(name);
      continue;
    }
    study.cells.push_back({.name = name,
                           .cell = read_cell(cell / "1_segment"),
                           .forces = read_adhesion_forces(cell / "4_fit/adhesion_forces.csv"),
                           .tensions = read_tensions(cell / "4_fit/tensions.csv"),
                           .fit = read_fit_summary(cell / "4_fit/fit.json")});
  }
  if (study.cells.empty()) {
    throw InputError(folder.string(), "at least one finished cell",
                     "none of " + std::to_string(study.unfinished.size()),
                     "run them first: mbtfm batch " + folder.string());
  }
  return study;
}

std::vector<MeasuredFibre> measured_fibres(const Study& study) {
  std::vector<MeasuredFibre> fibres;
  for (const StudyCell& cell : study.cells) {
    std::map<int, const Tension*> tension;
    for (const Tension& t : cell.tensions) tension[t.fibre_id] = &t;
    for (const Fibre& fibre : cell.cell.fibres) {
      const auto found = tension.find(fibre.fibre_id);
      if (found != tension.end() && found->second->identifiable) fibres.push_back({&cell, &fibre, found->second});
    }
  }
  return fibres;
}

std::vector<TypeSummary> summarise_types(const Study& study, const StudyParameters& parameters) {
  const std::vector<MeasuredFibre> fibres = measured_fibres(study);
  std::vector<TypeSummary> list;
  std::map<FibreType, std::set<std::string>> cells_with;
  for (const MeasuredFibre& f : fibres) cells_with[f.fibre->type].insert(f.cell->name);
  for (const auto& [type, tensions] : tensions_by_type(fibres)) {
    list.push_back(summarise("", type, static_cast<int>(cells_with[type].size()), tensions, parameters));
  }
  for (const StudyCell& cell : study.cells) {
    std::vector<MeasuredFibre> own;
    std::copy_if(fibres.begin(), fibres.end(), std::back_inserter(own),
                 [&](const MeasuredFibre& f) { return f.cell == &cell; });
    for (const auto& [type, tensions] : tensions_by_type(own)) {
      list.push_back(summarise(cell.name, type, 1, tensions, parameters));
    }
  }
  return list;
}

std::vector<TypeTest> test_types(const Study& study) {
  const std::vector<MeasuredFibre> fibres = measured_fibres(study);
  std::vector<TypeTest> tests;
  add_tests(tensions_by_type(fibres), Unit::fibre, tests);
  add_tests(medians_by_type(fibres), Unit::cell_median, tests);
  return tests;
}

}  // namespace mbtfm::statistics
