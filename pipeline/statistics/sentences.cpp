#include <fmt/format.h>

#include <algorithm>
#include <set>

#include "pipeline/contract/counted.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/page.h"
#include "pipeline/report/texts.h"
#include "pipeline/statistics/analysis.h"
#include "pipeline/statistics/study_files.h"

namespace mbtfm::statistics {

namespace {

using charts::readable;

std::string plural_of(const Sample& sample, const std::string& kind) {
  if (sample.each == Observed::cells || sample.each == Observed::bundles || is_in_space(sample.of_cells()))
    return name_of(sample.each);
  if (sample.each == Observed::sheets) return sample.n_kinds() == 1 ? "sheets" : "sheets (" + kind + ")";
  return named<FibreType>(kind) == FibreType::arc ? "transverse arcs" : kind + " " + name_of(sample.each);
}

/// A capital letter, but of a condition, which keeps its name.
std::string begun(const std::string& condition, const std::string& text) {
  return !condition.empty() && text.starts_with(prefix_of(condition)) ? text : report::capitalised(text);
}

/// What its observations are, where a cell may have several.
const char* counted_name(const Sample& sample) {
  if (sample.each == Observed::adhesions_in_space) return "adhesions";
  return sample.each == Observed::sheets ? "parts" : name_of(sample.each);
}

/// "the mean tension of ventral fibres is 4.1 nN [95 % CI … to …] (12 cells, 80 fibres)", for each condition and kind.
std::vector<std::string> means(const Measure& m) {
  const Sample& sample = m.sample;
  if (m.summaries.empty()) return {fmt::format("No {} of {} is known.", sample.name, name_of(sample.each))};
  std::vector<std::string> list;
  for (const Summary& s : m.summaries) {
    const report::WithInterval mean = s.model ? report::with_interval(s.model->estimate, s.model->low, s.model->high)
                                              : report::WithInterval{readable(s.plain.mean), {}};
    std::string text =
        fmt::format("{}the {}{} of {} is {}", prefix_of(s.condition), sample.name.starts_with("mean") ? "" : "mean ",
                    sample.name, plural_of(sample, s.kind), sample.amount(mean.value));
    if (s.model) text += " [95 % CI " + mean.interval + "]";
    text += " (" + counted(s.n_cells, sample.cells_name());
    if (!sample.is_one_a_cell()) text += ", " + counted(s.n, counted_name(sample));
    if (!s.model) text += s.n_cells == 1 ? ": no interval" : ", no interval: " + m.obstacle;
    text += ")";
    if (sample.each != Observed::cells && s.typical_error && s.n > 2)
      text += fmt::format("; SD {}, {} without the errors of measurement", sample.amount(*s.plain.standard_deviation),
                          readable(s.without_error->standard_deviation));
    list.push_back(begun(s.condition, text + "."));
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
    findings.sentences.push_back(
        report::sentence("study.cannot-be-said", m.sample.name, name_of(m.sample.each), who,
                         m.model ? fmt::format("each needs values of two {}", m.sample.cells_name()) : m.obstacle));
  };
  std::set<int> compared;
  for (const Observation& o : m.sample.values)
    if (o.kind < m.sample.n_compared) compared.insert(o.kind);
  if (compared.size() > 1)
    add(Question::between_kinds, m.sample.each == Observed::fibres   ? "types"
                                 : m.sample.each == Observed::sheets ? "parts"
                                                                     : "connected and unconnected ones");
  if (n_different(m.summaries, &Summary::condition) > 1) add(Question::between_conditions, "conditions");
}

/// A sentence for each pair that the mixed model compares, with those that clearly differ or with the others. Signs are
/// those of tests.csv.
void add_differences(const Measure& m, Findings& findings) {
  add_unanswered(m, findings);
  const bool is_one_a_cell = m.sample.is_one_a_cell();
  for (const Comparison& c : m.comparisons) {
    if (c.test != Test::mixed_model || c.group_b.empty() || !c.interval) continue;
    std::string text =
        c.question == Question::between_kinds
            ? fmt::format("{}{} of {} minus that of {}", prefix_of(c.within), m.sample.name,
                          plural_of(m.sample, c.group_a), plural_of(m.sample, c.group_b))
            : fmt::format("{} of {}, {} minus {}", m.sample.name, plural_of(m.sample, c.within), c.group_a, c.group_b);
    const auto [effect, interval] = report::with_interval(c.effect, c.interval->low, c.interval->high);
    text += fmt::format(": {} [95 % CI {}] (mixed model, t({}) = {}, {}", m.sample.amount(effect), interval,
                        readable(*c.degrees), readable(c.statistic), p_text(*c.p_holm));
    const Comparison* ranks = same_pair(m, c, is_one_a_cell ? Test::mann_whitney : Test::clustered_rank_sum);
    if (ranks != nullptr)
      text +=
          fmt::format("; {}, {}", is_one_a_cell ? "Mann–Whitney" : "clustered rank-sum test", p_text(*ranks->p_holm));
    text += fmt::format("; {} and {} {}", c.cells_a, c.cells_b, m.sample.cells_name());
    if (!is_one_a_cell) text += fmt::format(", {} and {} {}", c.n_a, c.n_b, counted_name(m.sample));
    constexpr double kLevel = 0.05;
    (*c.p_holm < kLevel ? findings.sentences : findings.unclear).push_back(begun(c.within, text + ")."));
  }
}

std::vector<std::string> shares(const Analysis& analysis, const StudyParameters& parameters) {
  std::vector<std::string> list;
  for (const ShareAbove& s : analysis.shares) {
    if (s.threshold_nN != parameters.strong_tension_nN) continue;
    list.push_back(begun(
        s.condition, report::sentence("study.share-above", prefix_of(s.condition), 100 * s.share.value,
                                      plural_of(analysis.tensions().sample, s.kind), readable(s.threshold_nN),
                                      100 * s.share.interval.low, 100 * s.share.interval.high, counted(s.n, "fibres"),
                                      counted(s.n_cells, "cells"), 100 * s.without_error)));
  }
  return list;
}

std::vector<std::string> lines(const Analysis& analysis) {
  std::vector<std::string> list;
  for (const Correlation& c : analysis.correlations) {
    if (c.force != "total_force_nN" || !c.line) continue;
    std::string text = report::sentence("study.force-for-size", prefix_of(c.condition),
                                        report::with_error(c.line->slope, c.line->slope_error), c.size_unit,
                                        counted(std::ssize(c.x), "cells"));
    if (c.line->correlation) text += ", r = " + readable(*c.line->correlation);
    list.push_back(begun(c.condition, text + ")."));
  }
  return list;
}

std::vector<std::string> directions(const Analysis& analysis) {
  std::vector<std::string> list;
  if (analysis.directions.empty()) {
    list.push_back(report::sentence("study.no-direction"));
  }
  for (const DirectionSummary& s : analysis.directions) {
    std::string text = fmt::format("{}{} differ by {:.0f}° in the mean", prefix_of(s.condition),
                                   full_name_of(s.relation), s.mean_angle_deg);
    if (s.angle_interval_deg)
      text += fmt::format(" [95 % CI {:.0f}° to {:.0f}°]", s.angle_interval_deg->low, s.angle_interval_deg->high);
    list.push_back(begun(s.condition, text + fmt::format(", where chance would give {:.0f}° ({} of {}).",
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
  const auto of = [](const char* title, const std::vector<const Measure*>& measures) {
    Findings findings{title, {}, {}};
    for (const Measure* m : measures) {
      append(findings.sentences, means(*m));
      add_differences(*m, findings);
    }
    return findings;
  };
  std::vector<Findings> all;
  if (analysis.has_fibres) {
    std::vector<const Measure*> of_cells;
    for (const Measure& m : analysis.measures)
      if (m.sample.each == Observed::cells) of_cells.push_back(&m);
    Findings tensions = of("Tensions", {&analysis.tensions()}), cells = of("Cells", of_cells);
    append(tensions.sentences, shares(analysis, parameters));
    append(cells.sentences, lines(analysis));
    all = {tensions,
           of("Adhesions", {&analysis.of("adhesion_force_nN"), &analysis.of("adhesion_area_um2")}),
           cells,
           {"Directions", directions(analysis), {}}};
  }
  for (const CellKind kind : kKindsOfCells)
    if (const auto measures = analysis.of_cells(kind); !has_fibres(kind) && !measures.empty())
      all.push_back(of(in_study(kind).heading, measures));
  return all;
}

}  // namespace mbtfm::statistics
