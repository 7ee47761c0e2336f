#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "pipeline/contract/counted.h"
#include "pipeline/contract/version.h"
#include "pipeline/files/own_files.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/page.h"
#include "pipeline/statistics/analysis.h"
#include "pipeline/statistics/study_files.h"

namespace mbtfm::statistics {
namespace {

using charts::html_escaped;
using charts::readable;
using report::number;
using report::Table;

std::string p_cell(double p) { return p < 1e-4 ? fmt::format("{:.1e}", p) : readable(p); }

std::string number_text(const std::optional<double>& value) { return report::rounded(value, {}); }

std::string interval_text(const std::optional<Interval>& interval) {
  return interval ? readable(interval->low) + " to " + readable(interval->high) : "–";
}

/// Between what names the summary and its scatter: mean and 95 % of the mixed model, plain mean and its 95 %.
void add_row(Table& table, std::vector<std::string> row, const Summary& s, const std::vector<std::string>& scatter) {
  const auto interval = s.model ? std::optional(Interval{s.model->low, s.model->high}) : std::nullopt;
  row.insert(row.end(), {s.model ? readable(s.model->estimate) : "–", interval_text(interval), readable(s.plain.mean),
                         interval_text(s.mean_interval)});
  row.insert(row.end(), scatter.begin(), scatter.end());
  table.rows.push_back(std::move(row));
}

bool has_conditions(const Study& study) { return study.conditions.size() > 1 || !study.conditions.front().empty(); }

/// The charts and what they show, without the title.
std::string charts_of(const Figure& figure) {
  std::string html = "<div class=\"grid\">\n";
  for (const charts::Chart& chart : figure.charts) html += report::figure(chart, {});
  return html + "</div>\n<p class=\"sub\">" + html_escaped(figure.caption) + "</p>\n";
}

std::string embedded(const Figure& figure) {
  if (figure.charts.empty())
    return "<h3>" + html_escaped(figure.title) + "</h3>\n<p class=\"sub\">Not drawn: " + html_escaped(figure.caption) +
           "</p>\n";
  const bool is_named = figure.charts.size() == 1 && figure.charts.front().title() == figure.title;
  return (is_named ? "" : "<h3>" + html_escaped(figure.title) + "</h3>\n") + charts_of(figure);
}

void without_column(Table& table, std::ptrdiff_t column) {
  table.columns.erase(table.columns.begin() + column);
  for (auto& row : table.rows) row.erase(row.begin() + column);
}

Table types_table(const Study& study, const Analysis& analysis) {
  Table table{"Tension by fibre type",
              {"condition", "type", number("cells"), number("fibres"), number("mean, mixed model (nN)"), number("95 %"),
               number("plain mean (nN)"), number("95 %, cells resampled"), number("median (nN)"), number("SD (nN)"),
               number("SD without error (nN)")}};
  for (const Summary& s : analysis.tensions.summaries) {
    add_row(table, {html_escaped(s.condition), kind_for_people(s.kind), std::to_string(s.n_cells), std::to_string(s.n)},
            s,
            {readable(s.plain.median), number_text(s.plain.standard_deviation),
             s.without_error ? readable(s.without_error->standard_deviation) : "–"});
  }
  if (!has_conditions(study)) without_column(table, 0);
  return table;
}

std::string figure_name(const Sample& sample) {
  if (sample.each == Observed::bundles) return "tension of bundles (nN)";
  if (sample.each == Observed::adhesions_in_space) return "force of an adhesion (nN)";
  return sample.label();
}

/// What the sheets, or the cells in space, are like: a row for each figure, kind of part and condition.
/// @param cells  what they are called
Table figures_table(const Study& study, const std::vector<Measure>& measures, const std::string& title,
                    const std::string& cells) {
  Table table{
      title,
      {"figure", "condition", "of", number(cells), number("mean, mixed model"), number("95 %"), number("plain mean"),
       number("95 %, " + cells + " resampled"), number("SD"), number("SD without error")}};
  for (const Measure& m : measures) {
    for (const Summary& s : m.summaries) {
      add_row(table,
              {html_escaped(figure_name(m.sample)), html_escaped(s.condition), html_escaped(s.kind),
               std::to_string(s.n_cells)},
              s,
              {number_text(s.plain.standard_deviation),
               s.typical_error && s.without_error ? readable(s.without_error->standard_deviation) : "–"});
    }
  }
  const auto has_parts = [](const Measure& m) { return m.sample.n_kinds() > 1; };
  if (std::ranges::none_of(measures, has_parts)) without_column(table, 2);
  if (!has_conditions(study)) without_column(table, 1);
  return table;
}

Table tests_table(const Measure& m) {
  Table table{"Tests of the " + m.sample.name,
              {"within", "test", "unit", "groups", "observations", "cells", number("statistic"), number("d.f."),
               number("p"), number("p (Holm)"), number("effect"), "95 %", "effect is"}};
  for (const Comparison& t : m.comparisons) {
    const bool is_pair = !t.group_b.empty();
    table.rows.push_back({html_escaped(t.within), name_of(t.test), name_of(t.unit),
                          html_escaped(is_pair ? t.group_a + " – " + t.group_b : t.group_a),
                          is_pair ? fmt::format("{}, {}", t.n_a, t.n_b) : std::to_string(t.n_a),
                          is_pair ? fmt::format("{}, {}", t.cells_a, t.cells_b) : std::to_string(t.cells_a),
                          readable(t.statistic), t.degrees ? readable(*t.degrees) : "–", p_cell(t.p_value),
                          t.p_holm ? p_cell(*t.p_holm) : "–", t.effect_name.empty() ? "–" : readable(t.effect),
                          interval_text(t.interval), html_escaped(t.effect_name)});
  }
  return table;
}

std::string enters_text(const StudyCell& c) { return c.fit.converged ? "yes" : "yes, not converged"; }

Table cells_table(const Study& study) {
  Table table{
      "Cells with fibres",
      {"cell", "condition", number("fibres"), number("adhesions"), number("total force (nN)"), number("of fibres (nN)"),
       number("of network (nN)"), number("relative L2"), number("expected"), "enters"}};
  for (const StudyCell& c : study.cells) {
    if (c.kind() != CellKind::plane) continue;
    table.rows.push_back({html_escaped(c.name), html_escaped(condition_of(study, c)),
                          std::to_string(c.cell.fibres.size()), std::to_string(c.cell.adhesions.size()),
                          readable(c.fit.total_force_nN), is_network_known(c) ? readable(c.fit.fibre_force_nN) : "–",
                          is_network_known(c) ? readable(c.fit.network_force_nN) : "–", readable(c.fit.relative_l2),
                          readable(c.fit.expected_relative_l2), enters_text(c)});
  }
  return table;
}

/// "2.0 (1.9 to 2.2)", "> 30", or nothing of what nobody asked for; with the part's name where it is not the sheet.
std::string estimates_text(const StudyCell& c, SheetQuantity quantity) {
  std::string text;
  for (const SheetEstimate& e : c.sheet->estimates) {
    if (e.quantity != quantity) continue;
    text += (text.empty() ? "" : "; ") + (kind_of_part(e) == kWholeSheet ? std::string() : e.part + ": ");
    if (is_given(e))
      text += readable(e.value) + " (given)";
    else if (e.identifiable)
      text += fmt::format("{} ({} to {})", readable(e.value), readable(*e.low), readable(*e.high));
    else
      text += e.low ? "> " + readable(*e.low) : e.high ? "< " + readable(*e.high) : "not known";
  }
  return text.empty() ? "–" : text;
}

Table sheets_table(const Study& study) {
  Table table{"Sheets",
              {"sheet", "condition", number("contraction (nN/µm)"), number("stiffness (nN/µm)"),
               number("mean tension (nN/µm)"), number("total force (nN)"), number("strain energy (fJ)"),
               number("area (µm²)"), number("relative L2"), number("expected"), "enters"}};
  for (const StudyCell& c : study.cells) {
    if (!c.sheet) continue;
    table.rows.push_back({html_escaped(c.name), html_escaped(condition_of(study, c)),
                          html_escaped(estimates_text(c, SheetQuantity::contraction)),
                          html_escaped(estimates_text(c, SheetQuantity::stiffness)),
                          readable(c.sheet->mean_tension_nN_per_um), readable(c.sheet->total_force_nN),
                          number_text(c.sheet->strain_energy_fJ), readable(c.sheet->area_um2),
                          readable(c.sheet->relative_l2), readable(c.sheet->expected_relative_l2), enters_text(c)});
  }
  return table;
}

Table cells_in_space_table(const Study& study) {
  Table table{"Cells in space",
              {"cell", "condition", "method", number("total force (nN)"), number("strain energy (fJ)"),
               number("contractile moment (nN µm)"), number("normal share"), number("largest traction (kPa)"),
               number("net force (nN)"), number("net moment (nN µm)"), number("resolution (µm)"), number("adhesions"),
               number("relative L2"), "enters"}};
  for (const StudyCell& c : study.cells) {
    if (!c.space) continue;
    const SpaceFigures& s = *c.space;
    table.rows.push_back(
        {html_escaped(c.name), html_escaped(condition_of(study, c)), html_escaped(s.method),
         report::with_error(s.total_force_nN, s.total_force_sigma_nN), readable(s.strain_energy_fJ),
         s.contractile_moment_nN_um ? report::with_error(*s.contractile_moment_nN_um, s.contractile_moment_sigma_nN_um)
                                    : "–",
         readable(s.normal_share()), readable(s.largest_traction_kPa), readable(s.net_force_nN),
         readable(s.net_moment_nN_um), number_text(s.resolution_um),
         s.adhesions.empty() ? "–" : std::to_string(s.adhesions.size()), readable(c.fit.relative_l2), enters_text(c)});
  }
  return table;
}

Table left_out_table(const Study& study) {
  Table table{"Left out", {"cell", "condition", "why"}};
  for (const LeftOutCell& c : study.left_out)
    table.rows.push_back({html_escaped(c.name), html_escaped(c.condition), html_escaped(c.reason)});
  return table;
}

/// The first names; of many.
std::string first_of(const std::vector<std::string>& names) {
  constexpr std::size_t kMost = 5;
  const auto n = std::min(kMost, names.size());
  return fmt::format("{}{}", fmt::join(names.begin(), names.begin() + static_cast<std::ptrdiff_t>(n), ", "),
                     names.size() > kMost ? ", …" : "");
}

/// Open findings, each with the cells that have it.
Table findings_table(const Study& study) {
  Table table{"Open findings", {"finding", "severity", number("cells"), "of them", "what to do"}};
  std::map<std::string, std::pair<const Finding*, std::vector<std::string>>> by_id;
  for (const StudyCell& c : study.cells) {
    for (const Finding& f : c.findings) {
      if (!is_open(f)) continue;
      auto& [finding, cells] = by_id[f.id];
      finding = &f;
      if (cells.empty() || cells.back() != c.name) cells.push_back(c.name);
    }
  }
  for (const auto& [id, found] : by_id) {
    const auto& [finding, cells] = found;
    table.rows.push_back({html_escaped(id), name_of(finding->severity), std::to_string(cells.size()),
                          html_escaped(first_of(cells)), html_escaped(finding->remedy)});
  }
  return table;
}

std::string findings_text(const Study& study, const std::string& table_html) {
  const auto n_open = std::ranges::count_if(study.cells, [](const StudyCell& c) { return has_open(c.findings); });
  if (n_open == 0) return "<p><b>✓</b> No finding is open in any cell that enters.</p>\n";
  return fmt::format(
             "<p>Findings are open in {} of {}: what they name may be off by more than the error bars say. The column "
             "<code>exclude</code> of the table of conditions leaves a cell out.</p>\n",
             n_open, counted(study.cells.size(), "cells")) +
         table_html;
}

/// Every cell that enters, as its segmentation looks, linked to its page where the study lies beside the cells.
std::string gallery(const Study& study, const Path& page_folder) {
  std::string html = "<div class=\"cells\">\n";
  for (const StudyCell& c : study.cells) {
    const Path folder = study.folder / c.name, picture = folder / "1_segment/thumbnail.jpg";
    const std::string link = (folder / "report.html").lexically_relative(page_folder).generic_string();
    const std::string& condition = condition_of(study, c);
    const double force_nN = c.sheet   ? c.sheet->total_force_nN
                            : c.space ? c.space->total_force_nN
                                      : c.fit.total_force_nN;
    const std::string text = fmt::format("{}{}{}: {}{} nN", c.name, condition.empty() ? "" : ", ", condition,
                                         c.sheet   ? "sheet, "
                                         : c.space ? "in space, "
                                                   : "",
                                         readable(force_nN));
    html += fmt::format(
        "<a href=\"{}\">{}<span>{}{}</span></a>\n", html_escaped(link),
        files::is_own_file(picture) ? "<img alt=\"\" src=\"" + report::data_address(picture, "image/jpeg") + "\">" : "",
        html_escaped(text), has_open(c.findings) ? " <b>!</b>" : "");
  }
  return html +
         "</div>\n<p class=\"sub\">Total force of each cell; a click opens its page. <b>!</b>: findings are open. To "
         "leave cells out by a rule: <code>--exclude_findings</code>; one by one: a column <code>exclude</code> with "
         "the reason in <code>--table</code>.</p>\n";
}

std::string list_of(const std::vector<std::string>& sentences) {
  std::string html = "<ul>\n";
  for (const std::string& s : sentences) html += "<li>" + html_escaped(s) + "</li>\n";
  return html + "</ul>\n";
}

std::string overview(const Study& study, const Analysis& analysis) {
  std::size_t n_fibres = 0, n_adhesions = 0, n_contractions = 0;
  for (const StudyCell& c : study.cells) {
    n_fibres += c.cell.fibres.size();
    n_adhesions += static_cast<std::size_t>(
        std::ranges::count_if(c.cell.adhesions, [](const Adhesion& a) { return !is_assumed(a.origin); }));
    n_contractions += c.sheet && std::ranges::any_of(c.sheet->estimates, [](const SheetEstimate& e) {
                        return e.quantity == SheetQuantity::contraction && enters(e);
                      });
  }
  const int with_fibres = n_of_kind(study, CellKind::plane), sheets = n_of_kind(study, CellKind::sheet),
            in_space = n_of_kind(study, CellKind::space);
  std::string html = "<p>";
  if (with_fibres > 0) {
    html += fmt::format("{} with {} and {}; the tensions of {} of them could be identified and enter the statistics. ",
                        counted(with_fibres, "cells"), counted(n_adhesions, "adhesions"),
                        counted(n_fibres, "stress fibres"), analysis.tensions.sample.values.size());
  }
  if (sheets > 0) {
    html += fmt::format(
        "{}: cells or colonies that are taken as contracting sheets, without fibres. The contraction of {} of them "
        "could be identified and enters the statistics. ",
        counted(sheets, "sheets"), n_contractions);
  }
  if (in_space > 0)
    html += fmt::format(
        "{} in space, of beads in the gel’s volume: their tractions are compared by total force, strain energy, "
        "contractile moment and what the tables below list. ",
        counted(in_space, "cells"));
  if ((with_fibres > 0) + (sheets > 0) + (in_space > 0) > 1)
    html +=
        "Figures of cells with fibres, of sheets and of cells in space are kept apart: they have different meanings. ";
  if (has_conditions(study)) html += counted(study.conditions.size(), "conditions") + ". ";
  html += (study.left_out.empty() ? "No cell was left out."
                                  : fmt::format("{} left out: see the table of cells.",
                                                counted(study.left_out.size(), "cell was", "cells were"))) +
          "</p>\n";
  if (!analysis.warnings.empty()) html += "<h3>What to distrust</h3>\n" + list_of(analysis.warnings);
  return html;
}

/// What the study was made for, before anything else.
std::string primary_section(const Study& study, const Analysis& analysis, const std::vector<Figure>& figures) {
  const Primary& primary = analysis.primary;
  std::string html;
  if (study.conditions.size() < 2) {
    html =
        "<p>The study has one condition: there is nothing to compare. Give each cell a condition: a column "
        "<code>condition</code> in <code>--table</code>, or <code>--condition-from folder</code>.</p>\n";
  } else if (primary.differences.empty()) {
    html = "<p>The " + html_escaped(primary.measure) + " cannot be compared: " + html_escaped(primary.obstacle) +
           ".</p>\n";
  }
  for (const PrimaryDifference& d : primary.differences)
    html += "<p class=\"what\"><b>" + html_escaped(report::capitalised(sentence_of(primary, d))) + ".</b></p>\n";
  for (const Figure& figure : figures)
    if (figure.name == kPrimaryFigure) html += charts_of(figure);
  if (!primary.differences.empty())
    html += "<p class=\"sub\">Test: " + html_escaped(primary.test) +
            ", two-sided; p by Holm over the conditions. It was chosen by the parameters <code>primary</code> and "
            "<code>primary_type</code>, not by its result. All other tests of this page are exploratory.</p>\n";
  return html;
}

constexpr const char* kHowToRead =
    "<p class=\"sub\">Two-sided. The fibres of a cell are not independent: tests whose unit is the observation "
    "overstate the evidence; those with the unit cell do not (clustered rank sum: Datta &amp; Satten 2005; mixed "
    "model: random effects of the cell and of each kind in it, known error of each value, Satterthwaite’s degrees of "
    "freedom). Holm’s correction is over the pairs that one question compares.</p>\n";

/// Which type edge fibres count as; empty without any.
std::string on_edge_fibres(const Study& study) {
  std::size_t n = 0;
  for (const StudyCell& cell : study.cells)
    n += static_cast<std::size_t>(
        std::ranges::count_if(cell.cell.fibres, [](const Fibre& f) { return f.type == FibreType::edge; }));
  if (n == 0) return "";
  return fmt::format("<p class=\"sub\">{} a free piece of the outline and {} held at both ends. {}</p>\n",
                     counted(n, "edge fibre runs along", "edge fibres run along"), n == 1 ? "is" : "are",
                     study.n_fibre_types < 4
                         ? "Here they count as ventral fibres; stats.fibre_types = 4 shows them as a type of their own."
                         : "Here they are a type of their own.");
}

constexpr const char* kHowToReadSheets =
    "<p class=\"sub\">Errors of the fit are known of what the beads were asked for; the others have none. What the "
    "gel’s numbers and its model add to them is left out: sheets on gels of one kind share it. A number that the beads "
    "limit to one side only, or that was given, does not enter.</p>\n";

constexpr const char* kHowToReadSpace =
    "<p class=\"sub\">Total force: sum of the sizes of all tractions. Contractile moment: −∫ (x − centre) · t dA, "
    "above zero where the cell contracts. Share of the normal force: of the sizes. Smoothing takes from force, energy "
    "and largest traction, the more the coarser the maps are: compare the resolution first. Net force and net moment "
    "of a cell that nothing else holds are errors alone; they are listed with the cells and not compared.</p>\n";

/// "Stress-fibre tensions of 8 cells, contraction of 4 sheets and forces of 6 cells in space"
std::string title_of(const Study& study) {
  std::vector<std::string> parts;
  const auto add = [&](CellKind kind, const std::string& what, const std::string& one, const std::string& many) {
    if (const int n = n_of_kind(study, kind); n > 0) parts.push_back(what + " of " + counted(n, one, many));
  };
  add(CellKind::plane, "stress-fibre tensions", "cell", "cells");
  add(CellKind::sheet, "contraction", "sheet", "sheets");
  add(CellKind::space, "forces", "cell in space", "cells in space");
  std::string title = parts.front();
  for (std::size_t i = 1; i < parts.size(); ++i) title += (i + 1 < parts.size() ? ", " : " and ") + parts[i];
  return report::capitalised(title);
}

}  // namespace

std::string study_html(const Study& study, const Analysis& analysis, const std::vector<Figure>& figures,
                       const StudyParameters& parameters, const Path& page_folder) {
  const std::string title = title_of(study);
  const std::string head = fmt::format("<h1>{}</h1><p class=\"sub\">mbtfm {}</p>\n", title, kVersion);
  std::string body = report::section("Primary comparison", primary_section(study, analysis, figures)) +
                     report::section("In short", overview(study, analysis));
  std::string found;
  for (const Findings& f : findings_of(analysis, parameters)) {
    if (!f.sentences.empty()) found += "<h3>" + f.title + "</h3>\n" + list_of(f.sentences);
    if (f.unclear.empty()) continue;
    found += fmt::format("<details><summary>{} not demonstrably differ</summary>\n{}</details>\n",
                         counted(f.unclear.size(), "pair that does", "pairs that do"), list_of(f.unclear));
  }
  body += report::section("What was found, exploratory", found);
  std::string pictures;
  for (const Figure& figure : figures)
    if (figure.name != kPrimaryFigure) pictures += embedded(figure);
  const auto files = tables_of(study, analysis);
  const auto with_file = [&](const Table& table, const std::string& name) {
    const auto file = std::ranges::find_if(files, [&](const auto& f) { return f.first == name; });
    return report::html_of(table, {file->first, file->second});
  };
  body += report::section("What the program noticed",
                          findings_text(study, with_file(findings_table(study), "findings.csv")));
  body += report::section("Figures", pictures);
  if (!analysis.sheets.empty())
    body += report::section(
        "Figures of the sheets",
        kHowToReadSheets +
            with_file(figures_table(study, analysis.sheets, "Figures of the sheets", "sheets"), "summaries.csv"));
  if (!analysis.in_space.empty())
    body += report::section(
        "Figures of the cells in space",
        kHowToReadSpace + with_file(figures_table(study, analysis.in_space, "Figures of the cells in space", "cells"),
                                    "summaries.csv"));
  if (analysis.has_fibres)
    body += report::section("Tension by fibre type",
                            on_edge_fibres(study) + with_file(types_table(study, analysis), "types.csv"));
  std::string tests;
  for (const Measure* m : analysis.measures()) {
    if (!m->comparisons.empty())
      tests += report::folded("Tests of the " + m->sample.name + " of " + name_of(m->sample.each),
                              report::html_of(tests_table(*m)));
  }
  body += report::section("Exploratory tests", tests + kHowToRead);
  std::string cells = gallery(study, page_folder);
  for (const Table& table :
       {cells_table(study), sheets_table(study), cells_in_space_table(study), left_out_table(study)})
    if (!table.rows.empty()) cells += with_file(table, "cells.csv");
  body += report::section("Cells", cells);
  return report::page(title + " – mbtfm", head, body);
}

}  // namespace mbtfm::statistics
