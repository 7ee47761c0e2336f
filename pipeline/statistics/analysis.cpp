#include "pipeline/statistics/analysis.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "pipeline/charts/chart.h"
#include "pipeline/contract/counted.h"
#include "pipeline/contract/listed.h"
#include "pipeline/report/texts.h"

namespace mbtfm::statistics {
namespace {

using charts::readable;

Measure measure(Sample sample, const std::vector<CellWeights>& draws) {
  Measure m{.sample = std::move(sample), .model = {}};
  ModelResult result = model_of(m.sample);
  m.model = std::move(result.model);
  m.obstacle = std::move(result.obstacle);
  m.summaries = summarise(m.sample, m.model, draws);
  m.comparisons = compare(m.sample, m.model);
  return m;
}

void warn_of_few_cells(const Study& study, std::vector<std::string>& warnings) {
  constexpr int kFew = 6;  // medians of five cells and five others cannot differ at p < 0.05 after correction
  for (const CellKind kind : mbtfm::values_of<CellKind>()) {
    std::vector<int> n_of(study.conditions.size(), 0);
    for (const StudyCell& cell : study.cells) n_of[cell.condition] += cell.kind() == kind ? 1 : 0;
    for (std::size_t i = 0; i < n_of.size(); ++i) {
      if (n_of[i] == 0 || n_of[i] >= kFew) continue;
      warnings.push_back(fmt::format("{}{} {} only: {}.", prefix_of(study.conditions[i]), n_of[i],
                                     n_of[i] == 1 ? in_study(kind).cell : traits_of(kind).many,
                                     n_of[i] == 1 ? "no scatter is known, and no test counts it"
                                                  : "intervals are wide, and suppose a normal scatter"));
    }
  }
}

void warn_of_tensions(const Study& study, const Measure& tensions, std::vector<std::string>& warnings) {
  int n_unknown = 0, n_fibres = 0, n_without = 0;
  for (const StudyCell& cell : study.cells) {
    n_without += has_fibres(cell.kind()) && measured_fibres(cell).empty() ? 1 : 0;
    for (const Tension& t : cell.tensions) {
      n_fibres += t.fibre_id != 0 ? 1 : 0;
      n_unknown += t.fibre_id != 0 && !t.identifiable ? 1 : 0;
    }
  }
  if (n_unknown > 0)
    warnings.push_back(report::sentence("study.warn-unresolved", n_unknown, counted(n_fibres, "fibres")));
  if (n_without > 0)
    warnings.push_back(report::sentence("study.warn-no-fibre", counted(n_without, "cell has", "cells have")));
  const int n_tensions = static_cast<int>(tensions.sample.values.size()), n_bare = tensions.sample.n_without_error;
  if (n_bare > 0)
    warnings.push_back(n_bare < n_tensions ? report::sentence("study.warn-some-without-errors", n_bare, n_tensions,
                                                              n_bare == 1 ? "has" : "have")
                                           : report::sentence("study.warn-without-errors"));
  for (const Summary& s : tensions.summaries) {
    const std::string fibres = prefix_of(s.condition) + kind_for_people(s.kind) + " fibres: ";
    if (s.n > 2 && s.typical_error && s.without_error->reliability < 0.5 && *s.plain.standard_deviation > 0)
      warnings.push_back(report::sentence("study.warn-mostly-error", fibres, readable(*s.typical_error)));
    if (s.model && s.mean_interval && std::abs(s.model->estimate - s.plain.mean) > 2 * s.model->standard_error)
      warnings.push_back(
          report::sentence("study.warn-means-differ", fibres, readable(s.model->estimate), readable(s.plain.mean)));
  }
}

void warn_of_networks(const Study& study, std::vector<std::string>& warnings) {
  const auto n = std::ranges::count_if(study.cells, [](const StudyCell& cell) { return !is_network_known(cell); });
  if (n == 0) return;
  warnings.push_back(report::sentence("study.warn-network-unresolved", n, counted(n_with_fibres(study), "cells")));
}

/// What the beads do not limit to both sides.
void warn_of_sheets(const Study& study, std::vector<std::string>& warnings) {
  for (const SheetQuantity quantity : mbtfm::values_of<SheetQuantity>()) {
    int n_unknown = 0, n = 0;
    for (const StudyCell& cell : study.cells) {
      if (!cell.sheet) continue;
      for (const SheetEstimate& e : cell.sheet->estimates) {
        n += e.quantity == quantity && !is_given(e) ? 1 : 0;
        n_unknown += e.quantity == quantity && !e.identifiable ? 1 : 0;
      }
    }
    if (n_unknown > 0)
      warnings.push_back(
          report::sentence("study.warn-sheets-unresolved", for_people(quantity).name, n_unknown, counted(n, "fits")));
  }
}

/// What makes maps of cells in space differ although the cells do not.
void warn_of_space(const Study& study, const Measure& resolution, std::vector<std::string>& warnings) {
  std::map<std::string, int> n_by_method;
  for (const StudyCell& cell : study.cells)
    if (cell.space) ++n_by_method[cell.space->method];
  if (n_by_method.size() > 1) {
    std::vector<std::string> methods;
    for (const auto& [method, n] : n_by_method) methods.push_back(fmt::format("{} ({})", method, counted(n, "cells")));
    warnings.push_back(report::sentence("study.warn-methods-differ", listed(methods)));
  }
  constexpr double kLevel = 0.05;
  for (const Comparison& c : resolution.comparisons) {
    if (c.test != Test::mixed_model || c.group_b.empty() || *c.p_holm >= kLevel) continue;
    const bool is_first_coarser = c.effect > 0;
    warnings.push_back(report::sentence("study.warn-resolution-differs", is_first_coarser ? c.group_a : c.group_b,
                                        is_first_coarser ? c.group_b : c.group_a,
                                        resolution.sample.amount(std::abs(c.effect))));
  }
}

/// Tests by observation that no test by cell confirms.
void warn_of_pseudo_replication(const Measure& m, std::vector<std::string>& warnings) {
  constexpr double kLevel = 0.05;
  for (const Comparison& by_value : m.comparisons) {
    if (by_value.unit != Unit::observation || by_value.group_b.empty() || *by_value.p_holm >= kLevel) continue;
    double smallest = 1;
    for (const Comparison& by_cell : m.comparisons) {
      const bool is_same = by_cell.unit == Unit::cell && by_cell.question == by_value.question &&
                           by_cell.within == by_value.within && by_cell.group_a == by_value.group_a &&
                           by_cell.group_b == by_value.group_b;
      if (is_same) smallest = std::min(smallest, *by_cell.p_holm);
    }
    if (smallest < kLevel) continue;
    warnings.push_back(report::sentence("study.warn-pseudo-replication", prefix_of(by_value.within), m.sample.name,
                                        kind_for_people(by_value.group_a), kind_for_people(by_value.group_b),
                                        name_of(m.sample.each), readable(*by_value.p_holm), readable(smallest)));
  }
}

}  // namespace

std::string prefix_of(const std::string& condition) {
  return condition.empty() ? "" : kind_for_people(condition) + ": ";
}

std::string kind_for_people(const std::string& kind) {
  return named<FibreType>(kind) == FibreType::arc ? "transverse arc" : kind;
}

const Measure* Analysis::find(const std::string& column) const {
  const auto at = std::ranges::find_if(measures, [&](const Measure& m) { return m.sample.column == column; });
  return at == measures.end() ? nullptr : &*at;
}

const Measure& Analysis::of(const std::string& column) const {
  static const Measure none;
  const Measure* found = find(column);
  return found ? *found : none;
}

std::vector<const Measure*> Analysis::of_cells(CellKind kind) const {
  std::vector<const Measure*> list;
  for (const Measure& m : measures)
    if (m.sample.of_cells() == kind) list.push_back(&m);
  return list;
}

PrimaryChoice primary_choice(const Study& study, const Analysis& analysis, const StudyParameters& parameters) {
  std::array kinds = kKindsOfCells;  // that of which the study has most comes first
  std::ranges::stable_sort(kinds, std::greater{}, [&](CellKind kind) { return n_of_kind(study, kind); });
  PrimaryMeasure asked = parameters.primary;
  if (asked == PrimaryMeasure::automatic) asked = in_study(kinds.front()).primary;
  if (asked == PrimaryMeasure::tension) {
    const Sample& sample = analysis.tensions().sample;
    const auto kind = std::ranges::find(sample.kinds, name_of(counted_type(study, parameters.primary_type)));
    return {kind == sample.kinds.end() ? nullptr : analysis.find("tension_nN"),
            static_cast<int>(kind - sample.kinds.begin()),
            "tension of " + kind_for_people(name_of(parameters.primary_type)) + " fibres"};
  }
  const CellKind kind = *std::ranges::find_if(kinds, [&](CellKind of) { return in_study(of).columns.contains(asked); });
  std::string name = name_of(asked);
  std::ranges::replace(name, '-', ' ');
  return {analysis.find(in_study(kind).columns.at(asked)), 0, name + " of " + traits_of(kind).many};
}

Analysis analyse(const Study& study, const StudyParameters& parameters) {
  const std::vector<CellWeights> draws = draw_cells(study, parameters);
  Analysis a;
  a.has_fibres = n_with_fibres(study) > 0;
  for (Sample& sample : samples_of(study)) a.measures.push_back(measure(std::move(sample), draws));
  a.tensions_by_cell = summarise_by_cell(a.tensions().sample, study);
  a.shares = shares_above(a.tensions().sample, thresholds_nN(parameters));
  const PrimaryChoice primary = primary_choice(study, a, parameters);
  if (primary.measure == nullptr) {
    a.primary.measure = primary.name;
    a.primary.obstacle = "no cell of the study has a known one";
  } else {
    a.primary = primary_of(study, primary.name, primary.measure->sample, primary.kind, primary.measure->model,
                           primary.measure->comparisons);
  }
  a.correlations = correlate_forces(study, draws);
  a.area_bins = bin_by_area(study, draws);
  a.directions = summarise_directions(study, draws);
  a.warnings = study.warnings;
  warn_of_few_cells(study, a.warnings);
  if (a.has_fibres) warn_of_tensions(study, a.tensions(), a.warnings);
  warn_of_networks(study, a.warnings);
  warn_of_sheets(study, a.warnings);
  warn_of_space(study, a.of(kResolution), a.warnings);
  for (const Measure& m : a.measures) warn_of_pseudo_replication(m, a.warnings);
  return a;
}

}  // namespace mbtfm::statistics
