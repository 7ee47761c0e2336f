/// The one comparison that a study was made for.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/report/numbers.h"
#include "pipeline/statistics/analysis.h"
#include "pipeline/statistics/rank_tests.h"

namespace mbtfm::statistics {

namespace {

/// Of one kind, by condition and replicate: the mean of the cells' means.
std::map<std::pair<int, std::string>, double> means_of_replicates(const Study& study, const Sample& sample, int kind) {
  std::map<int, CellMean> by_cell;
  for (const Observation& o : sample.values)
    if (o.kind == kind) by_cell[o.cell].add(o.cell, o.value);
  std::map<std::pair<int, std::string>, CellMean> by_replicate;
  for (const auto& [index, mean] : by_cell) {
    const StudyCell& cell = study.cells[index];
    by_replicate[{cell.condition, cell.replicate}].add(index, mean.mean());
  }
  std::map<std::pair<int, std::string>, double> means;
  for (const auto& [key, mean] : by_replicate) means[key] = mean.mean();
  return means;
}

int n_cells_of(const Sample& sample, int condition, int kind) { return n_cells_of(sample.of_group(condition, kind)); }

bool has_replicates(const Study& study) {
  return std::ranges::any_of(study.cells, [](const StudyCell& cell) { return !cell.replicate.empty(); });
}

void compare_replicates(const Study& study, const Sample& sample, int kind, Primary& primary) {
  primary.test = "means of the replicates, compared in pairs (Student’s t)";
  const auto means = means_of_replicates(study, sample, kind);
  std::vector<double> reference;
  for (const auto& [key, mean] : means)
    if (key.first == 0) reference.push_back(mean);
  primary.reference_mean = reference.empty() ? 0 : describe(reference).mean;
  for (int condition = 1; condition < sample.n_conditions(); ++condition) {
    std::vector<double> differences;
    for (const auto& [key, mean] : means) {
      const auto before = means.find({0, key.second});
      if (key.first == condition && before != means.end()) differences.push_back(mean - before->second);
    }
    const double n = static_cast<double>(differences.size());
    if (n < 2) continue;
    const Description d = describe(differences);
    if (!(*d.standard_deviation > 0)) continue;
    primary.differences.push_back({.condition = sample.conditions[condition],
                                   .difference = by_students_t(d.mean, *d.standard_deviation / std::sqrt(n), n - 1),
                                   .cells = n_cells_of(sample, condition, kind),
                                   .cells_before = n_cells_of(sample, 0, kind),
                                   .replicates = static_cast<int>(n)});
  }
  if (primary.differences.empty())
    primary.obstacle = "each condition needs two replicates that have " + primary.cells + " of the reference, too";
}

/// Of two groups with two cells each at least.
void compare_cells(const Sample& sample, int kind, const std::optional<SampleModel>& model,
                   const std::vector<Comparison>& comparisons, Primary& primary) {
  primary.test = fmt::format("mixed model with the {} as the unit (Student’s t)", sample.cell_name());
  if (const int group = sample.group_of(0, kind); model && model->index[group] >= 0)
    primary.reference_mean = model->fit.mean[model->index[group]];
  for (const Comparison& c : comparisons) {
    if (c.test != Test::mixed_model || c.question != Question::between_conditions || c.group_b.empty()) continue;
    if (c.within != sample.kinds[kind]) continue;
    if (c.group_b != primary.reference || !c.interval) continue;
    const double error = c.statistic != 0 ? std::abs(c.effect / c.statistic) : 0;
    if (!(error > 0)) continue;
    primary.differences.push_back({.condition = c.group_a,
                                   .difference = by_students_t(c.effect, error, *c.degrees),
                                   .cells = c.cells_a,
                                   .cells_before = c.cells_b});
  }
  if (primary.differences.empty())
    primary.obstacle = "the reference and one other condition need two " + primary.cells + " each with a known value";
}

}  // namespace

std::string p_text(double p) { return p < 1e-4 ? "p < 0.0001" : fmt::format("p = {:.2g}", p); }

std::string sentence_of(const Primary& primary, const PrimaryDifference& d) {
  const Contrast& c = d.difference;
  const auto [estimate, interval] = report::with_interval(c.estimate, c.low, c.high);
  std::string text =
      fmt::format("{}, {} minus {}: {} {}", primary.measure, d.condition, primary.reference, estimate, primary.unit);
  if (primary.reference_mean > 0)
    text +=
        fmt::format(" ({}{:.0f} %)", c.estimate < 0 ? "−" : "+", 100 * std::abs(c.estimate) / primary.reference_mean);
  text += fmt::format(" [95 % CI {} {}], {}; ", interval, primary.unit, p_text(d.p_holm));
  if (d.replicates > 0) text += counted(d.replicates, "replicates") + ", ";
  return text + fmt::format("{} and {} {}", d.cells, d.cells_before, primary.cells);
}

Primary primary_of(const Study& study, const std::string& name, const Sample& sample, int kind,
                   const std::optional<SampleModel>& model, const std::vector<Comparison>& comparisons) {
  Primary primary{.measure = name,
                  .unit = sample.unit,
                  .cells = sample.cells_name(),
                  .reference = study.conditions.front(),
                  .test = {}};
  if (study.conditions.size() < 2) {
    primary.obstacle = "the study has one condition";
    return primary;
  }
  MBTFM_ASSERT(kind < sample.n_kinds());
  if (has_replicates(study))
    compare_replicates(study, sample, kind, primary);
  else
    compare_cells(sample, kind, model, comparisons, primary);
  std::vector<double> p_values;
  for (const PrimaryDifference& d : primary.differences) p_values.push_back(d.difference.p_value);
  const std::vector<double> corrected = holm(p_values);
  for (std::size_t i = 0; i < corrected.size(); ++i) primary.differences[i].p_holm = corrected[i];
  return primary;
}

}  // namespace mbtfm::statistics
