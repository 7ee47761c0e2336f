#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "pipeline/contract/counted.h"
#include "pipeline/report/page.h"
#include "pipeline/statistics/analysis.h"
#include "pipeline/statistics/study_files.h"

namespace mbtfm::statistics {

using report::capitalised;
namespace {

using charts::readable;

std::string plural_of(const Sample& sample, const std::string& kind) {
  if (sample.each == Observed::cells || sample.each == Observed::bundles || sample.of_cells() == CellKind::space)
    return name_of(sample.each);
  if (sample.each == Observed::sheets) return sample.n_kinds() == 1 ? "sheets" : "sheets (" + kind + ")";
  return named<FibreType>(kind) == FibreType::arc ? "transverse arcs" : kind + " " + name_of(sample.each);
}

/// What its observations are, where a cell may have several.
const char* counted_name(const Sample& sample) {
  if (sample.each == Observed::adhesions_in_space) return "adhesions";
  return sample.each == Observed::sheets ? "parts" : name_of(sample.each);
}

std::string mean_text(const Summary& s, const Measure& m) {
  if (!s.model) {
    const std::string reason = s.n_cells == 1 ? std::string("there is a single ") + m.sample.cell_name() : m.obstacle;
    return fmt::format("{} (no interval: {})", m.sample.amount(s.plain.mean), reason);
  }
  return fmt::format("{} [95 % CI {} to {}]", m.sample.amount(s.model->estimate), readable(s.model->low),
                     readable(s.model->high));
}

/// "ventral fibres carry a tension of 4.1 nN [95 % CI …; the cell as the unit, 12 cells, 80 fibres]".
std::vector<std::string> means(const Measure& m) {
  std::vector<std::string> list;
  if (m.summaries.empty()) {
    list.push_back(
        fmt::format("No {} of {} is known: nothing can be said of it.", m.sample.name, name_of(m.sample.each)));
  }
  for (const Summary& s : m.summaries) {
    std::string text = fmt::format("{}the mean {} of {} is {}", prefix_of(s.condition), m.sample.name,
                                   plural_of(m.sample, s.kind), mean_text(s, m));
    text += fmt::format(", the {} being the unit ({}", m.sample.cell_name(), counted(s.n_cells, m.sample.cells_name()));
    if (!m.sample.is_one_a_cell()) text += ", " + counted(s.n, counted_name(m.sample));
    text += ")";
    if (m.sample.each != Observed::cells && s.typical_error && s.n > 2) {
      text += fmt::format("; they scatter by {}, of which {} remain without the error of their measurement",
                          m.sample.amount(*s.plain.standard_deviation),
                          m.sample.amount(s.without_error->standard_deviation));
    }
    list.push_back(capitalised(text + "."));
  }
  return list;
}

const Comparison* same_pair(const Measure& m, const Comparison& c, Test test) {
  const auto at = std::ranges::find_if(m.comparisons, [&](const Comparison& o) {
    return o.test == test && o.unit == Unit::cell && o.question == c.question && o.within == c.within &&
           o.group_a == c.group_a && o.group_b == c.group_b;
  });
  return at == m.comparisons.end() ? nullptr : &*at;
}

/// How many different ones the summaries have: kinds, or conditions.
int n_different(const std::vector<Summary>& summaries, std::string Summary::*member) {
  std::set<std::string> names;
  for (const Summary& s : summaries) names.insert(s.*member);
  return static_cast<int>(names.size());
}

/// A sentence for each question that no test with the cell for the unit could answer.
void add_unanswered(const Measure& m, Findings& findings) {
  const auto add = [&](Question question, const std::string& who) {
    const bool is_answered = std::ranges::any_of(
        m.comparisons, [&](const Comparison& c) { return c.question == question && c.test == Test::mixed_model; });
    if (is_answered) return;
    findings.sentences.push_back(fmt::format(
        "Whether the {} of {} differs between {} cannot be said: {}.", m.sample.name, name_of(m.sample.each), who,
        m.model ? fmt::format("each needs values of two {}", m.sample.cells_name()) : m.obstacle));
  };
  if (n_different(m.summaries, &Summary::kind) > 1)
    add(Question::between_kinds, m.sample.each == Observed::fibres   ? "types"
                                 : m.sample.each == Observed::sheets ? "parts"
                                                                     : "connected and unconnected ones");
  if (n_different(m.summaries, &Summary::condition) > 1) add(Question::between_conditions, "conditions");
}

/// A sentence for each pair that the mixed model compares, with those that clearly differ or with the others.
void add_differences(const Measure& m, Findings& findings) {
  add_unanswered(m, findings);
  for (const Comparison& c : m.comparisons) {
    if (c.test != Test::mixed_model || c.group_b.empty() || !c.interval) continue;
    const bool is_of_kinds = c.question == Question::between_kinds;
    // the larger one first
    const bool is_turned = c.effect < 0;
    const std::string& larger = is_turned ? c.group_b : c.group_a;
    const std::string& smaller = is_turned ? c.group_a : c.group_b;
    const double low = is_turned ? -c.interval->high : c.interval->low,
                 high = is_turned ? -c.interval->low : c.interval->high;
    constexpr double kLevel = 0.05;
    const bool is_clear = *c.p_holm < kLevel;
    std::string text =
        is_of_kinds ? fmt::format("{}the {} of {} is {} larger than that of {}", prefix_of(c.within), m.sample.name,
                                  plural_of(m.sample, larger),
                                  is_clear ? m.sample.amount(std::abs(c.effect)) : "not demonstrably",
                                  plural_of(m.sample, smaller))
                    : fmt::format("the {} of {} is {} larger under {} than under {}", m.sample.name,
                                  plural_of(m.sample, c.within),
                                  is_clear ? m.sample.amount(std::abs(c.effect)) : "not demonstrably", larger, smaller);
    text += fmt::format(" (difference {} [95 % CI {} to {}]; mixed model, t({}) = {}, {}",
                        m.sample.amount(std::abs(c.effect)), readable(low), readable(high), readable(*c.degrees),
                        readable(std::abs(c.statistic)), p_text(*c.p_holm));
    const bool is_one_a_cell = m.sample.is_one_a_cell();
    const Comparison* ranks = same_pair(m, c, is_one_a_cell ? Test::mann_whitney : Test::clustered_rank_sum);
    if (ranks != nullptr)
      text +=
          fmt::format("; {}, {}", is_one_a_cell ? "Mann–Whitney" : "clustered rank-sum test", p_text(*ranks->p_holm));
    const int cells_a = is_turned ? c.cells_b : c.cells_a, cells_b = is_turned ? c.cells_a : c.cells_b;
    text += fmt::format("; {} and {} {}", cells_a, cells_b, m.sample.cells_name());
    if (!is_one_a_cell)
      text +=
          fmt::format(", {} and {} {}", is_turned ? c.n_b : c.n_a, is_turned ? c.n_a : c.n_b, counted_name(m.sample));
    (is_clear ? findings.sentences : findings.unclear).push_back(capitalised(text + ")."));
  }
}

std::vector<std::string> shares(const Analysis& analysis, const StudyParameters& parameters) {
  std::vector<std::string> list;
  for (const ShareAbove& s : analysis.shares) {
    if (s.threshold_nN != parameters.strong_tension_nN) continue;
    list.push_back(capitalised(
        fmt::format("{}{:.0f} % of the {} carry more than {} nN [95 % CI {:.0f} to {:.0f} %; {} of {}], {:.0f} % "
                    "without the blur of the measurement.",
                    prefix_of(s.condition), 100 * s.share.value, plural_of(analysis.tensions.sample, s.kind),
                    readable(s.threshold_nN), 100 * s.share.interval.low, 100 * s.share.interval.high,
                    counted(s.n, "fibres"), counted(s.n_cells, "cells"), 100 * s.without_error)));
  }
  return list;
}

std::vector<std::string> lines(const Analysis& analysis) {
  std::vector<std::string> list;
  for (const Correlation& c : analysis.correlations) {
    if (!c.is_of_total || !c.line) continue;
    const std::string error = c.line->slope_error ? " ± " + readable(*c.line->slope_error) : "";
    std::string text = fmt::format("{}the total force is {}{} nN for each {} ({}", prefix_of(c.condition),
                                   readable(c.line->slope), error, c.size_unit, counted(std::ssize(c.x), "cells"));
    if (c.line->correlation) text += ", r = " + readable(*c.line->correlation);
    list.push_back(capitalised(text + ")."));
  }
  return list;
}

std::vector<std::string> directions(const Analysis& analysis) {
  std::vector<std::string> list;
  if (analysis.directions.empty()) {
    list.push_back(
        "No direction is known: no fibre ends on an adhesion, and no beads near one moved by more than noise.");
  }
  for (const DirectionSummary& s : analysis.directions) {
    std::string text = fmt::format("{}{} differ by {:.0f}° in the mean", prefix_of(s.condition),
                                   full_name_of(s.relation), s.mean_angle_deg);
    if (s.angle_interval_deg)
      text += fmt::format(" [95 % CI {:.0f}° to {:.0f}°]", s.angle_interval_deg->low, s.angle_interval_deg->high);
    list.push_back(capitalised(text + fmt::format(", where chance would give {:.0f}° ({} of {}).",
                                                  largest_angle_deg(s.relation) / 2, counted(s.n, "angles"),
                                                  counted(s.n_cells, "cells"))));
  }
  return list;
}

void append(std::vector<std::string>& list, const std::vector<std::string>& more) {
  list.insert(list.end(), more.begin(), more.end());
}

}  // namespace

std::vector<Findings> findings_of(const Analysis& analysis, const StudyParameters& parameters) {
  const auto of_all = [](const char* title, const std::vector<Measure>& measures) {
    Findings findings{title, {}, {}};
    for (const Measure& m : measures) {
      append(findings.sentences, means(m));
      add_differences(m, findings);
    }
    return findings;
  };
  std::vector<Findings> all;
  if (!analysis.sheets.empty()) all.push_back(of_all("Sheets", analysis.sheets));
  if (!analysis.in_space.empty()) all.push_back(of_all("Cells in space", analysis.in_space));
  if (!analysis.has_fibres) return all;
  Findings tensions{"Tensions", means(analysis.tensions), {}}, cells = of_all("Cells", analysis.cells);
  Findings adhesions{"Adhesions", means(analysis.adhesion_forces), {}};
  add_differences(analysis.tensions, tensions);
  append(tensions.sentences, shares(analysis, parameters));
  add_differences(analysis.adhesion_forces, adhesions);
  add_differences(analysis.adhesion_areas, adhesions);
  append(cells.sentences, lines(analysis));
  all.insert(all.end(), {tensions, adhesions, cells, {"Directions", directions(analysis), {}}});
  return all;
}

}  // namespace mbtfm::statistics
