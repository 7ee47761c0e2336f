#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "pipeline/contract/counted.h"
#include "pipeline/files/own_files.h"
#include "pipeline/report/stage_page.h"
#include "pipeline/report/texts.h"
#include "pipeline/statistics/analysis.h"
#include "pipeline/statistics/study_files.h"

namespace mbtfm::statistics {
namespace {

using charts::html_escaped;
using charts::readable;
using report::number;
using report::Table;

bool has_conditions(const Study& study) { return study.conditions.size() > 1 || !study.conditions.front().empty(); }

std::string charts_of(const Figure& figure) {
  std::string html;
  for (const charts::Chart& chart : figure.charts) html += report::figure(chart, {});
  return html;
}

std::string caption_of(const Figure& figure) { return "<p class=\"sub\">" + html_escaped(figure.caption) + "</p>\n"; }

/// One that has a single chart takes one place of the grid, so that such lie beside each other.
std::string embedded(const Figure& figure) {
  if (figure.charts.size() == 1) return report::figure(figure.charts.front(), figure.caption);
  const std::string title = "<h3>" + html_escaped(figure.title) + "</h3>\n";
  if (figure.charts.empty())
    return "<div class=\"wide\">" + title + "<p class=\"sub\">Not drawn: " + html_escaped(figure.caption) +
           "</p></div>\n";
  return "<div class=\"wide\">" + title + "<div class=\"grid\">\n" + charts_of(figure) + "</div>\n" +
         caption_of(figure) + "</div>\n";
}

/// The study's tables by the names of their files.
struct Files {
  std::vector<std::pair<std::string, std::string>> all;
  /// Of one of them.
  report::Listing listing(const std::string& title, const std::string& file, const std::string& columns,
                          const std::vector<std::pair<std::string, std::string>>& only = {}) const {
    const auto at = std::ranges::find(all, file, &std::pair<std::string, std::string>::first);
    return {title, {}, file, at->second, columns, only};
  }
};

std::string measures_table(const Files& files) {
  return report::html_of(
      files.listing("All measures", "summaries.csv", report::sentence("study.columns-of-summaries")));
}

std::string tests_table(const Files& files, const Sample& sample) {
  return report::html_of(
      report::table_of(files.listing("Tests of the " + sample.name, "tests.csv",
                                     report::sentence("study.columns-of-tests"), {{"quantity", sample.column}})));
}

/// Of each kind, then those that were left out.
std::string cells_tables(const Files& files) {
  const auto table = [&](const char* title, const std::string& columns, const char* word, const char* is,
                         const char* file = "cells.csv") {
    return report::html_of(files.listing(title, file, "cell, condition, " + columns, {{word, is}}));
  };
  const std::string quality = report::sentence("study.columns-of-quality");
  return table("Cells with fibres", report::sentence("study.columns-of-cells") + quality, "model", "fibres") +
         table("Sheets", report::sentence("study.columns-of-sheets") + quality, "model", "sheet") +
         table("Estimates of the sheets", report::sentence("study.columns-of-estimates"), "enters", "TRUE",
               "sheets.csv") +
         table("Estimates that do not enter", report::sentence("study.columns-of-estimates"), "enters", "FALSE",
               "sheets.csv") +
         table("Cells in space", report::sentence("study.columns-in-space") + quality, "model", "space") +
         table("Left out", "reason", "included", "FALSE");
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

std::string findings_text(const Study& study, const Files& files) {
  const auto n_open = std::ranges::count_if(study.cells, [](const StudyCell& c) { return has_open(c.findings); });
  if (n_open == 0) return report::paragraph("study.nothing-open");
  return report::paragraph("study.findings-open", n_open, counted(study.cells.size(), "cells")) +
         report::html_of(findings_table(study), {"findings.csv", files.listing("", "findings.csv", "").csv});
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
  return html + "</div>\n" + report::note("study.gallery");
}

std::string list_of(const std::vector<std::string>& sentences) {
  std::string html = "<ul>\n";
  for (const std::string& s : sentences) html += "<li>" + html_escaped(s) + "</li>\n";
  return html + "</ul>\n";
}

std::string overview(const Study& study, const Analysis& analysis) {
  std::size_t n_fibres = 0, n_adhesions = 0;
  for (const StudyCell& c : study.cells) {
    n_fibres += c.cell.fibres.size();
    n_adhesions += static_cast<std::size_t>(
        std::ranges::count_if(c.cell.adhesions, [](const Adhesion& a) { return !is_assumed(a.origin); }));
  }
  std::string html = "<p>";
  if (const int n = n_with_fibres(study); n > 0)
    html += report::sentence("study.cells-with-fibres", counted(n, "cells"), counted(n_adhesions, "adhesions"),
                             counted(n_fibres, "stress fibres"), analysis.tensions().sample.values.size()) +
            " ";
  for (const CellKind kind : kKindsOfCells) {
    const int n = n_of_kind(study, kind);
    if (n == 0 || has_fibres(kind)) continue;
    html += counted(n, traits_of(kind).one, traits_of(kind).many);
    if (is_sheet(kind))
      html += fmt::format("; identified contractions: {}",
                          n_cells_of(analysis.of(name_of(SheetQuantity::contraction)).sample.values));
    html += ". ";
  }
  if (has_conditions(study)) html += counted(study.conditions.size(), "conditions") + ". ";
  html += counted(study.left_out.size(), "cell was", "cells were") + " left out.</p>\n";
  if (!analysis.warnings.empty()) html += "<h3>What to distrust</h3>\n" + list_of(analysis.warnings);
  return html;
}

/// What the study was made for, before anything else.
std::string primary_section(const Study& study, const Analysis& analysis, const std::vector<Figure>& figures) {
  const Primary& primary = analysis.primary;
  std::string html;
  if (study.conditions.size() < 2) {
    html = report::paragraph("study.one-condition");
  } else if (primary.differences.empty()) {
    html = "<p>The " + html_escaped(primary.measure) + " cannot be compared: " + html_escaped(primary.obstacle) +
           ".</p>\n";
  }
  for (const PrimaryDifference& d : primary.differences)
    html += "<p class=\"what\"><b>" + html_escaped(report::capitalised(sentence_of(primary, d))) + ".</b></p>\n";
  for (const Figure& figure : figures)
    if (figure.name == kPrimaryFigure)
      html += "<div class=\"grid\">\n" + charts_of(figure) + "</div>\n" + caption_of(figure);
  if (!primary.differences.empty()) html += report::note("study.primary-test", html_escaped(primary.test));
  return html;
}

/// What edge and unclassified fibres count as; empty without any.
std::string on_fibre_types(const Study& study) {
  std::ptrdiff_t n_edge = 0, n_unclassified = 0;
  for (const StudyCell& cell : study.cells) {
    n_edge += std::ranges::count(cell.cell.fibres, FibreType::edge, &Fibre::type);
    n_unclassified += std::ranges::count(cell.cell.fibres, FibreType::unclassified, &Fibre::type);
  }
  std::string notes;
  if (n_edge > 0)
    notes += report::note(
        "study.edge-fibres", counted(n_edge, "edge fibre runs along", "edge fibres run along"),
        n_edge == 1 ? "is" : "are",
        study.n_fibre_types < 4 ? report::sentence("study.edge-as-ventral") : "They are a type of their own.");
  if (n_unclassified > 0)
    notes += report::note(
        "study.unclassified-fibres", counted(n_unclassified, "fibre is", "fibres are"),
        study.n_fibre_types < 5 ? report::sentence("study.unclassified-listed") : "They are compared as a type.");
  return notes;
}

/// "Stress-fibre tensions of 8 cells, contraction of 4 sheets and forces of 6 cells in space"
std::string title_of(const Study& study) {
  std::vector<std::string> parts;
  for (const CellKind kind : kKindsOfCells)
    if (const int n = n_of_kind(study, kind); n > 0)
      parts.push_back(std::string(in_study(kind).found) + " of " +
                      counted(n, traits_of(kind).one, traits_of(kind).many));
  std::string title = parts.front();
  for (std::size_t i = 1; i < parts.size(); ++i) title += (i + 1 < parts.size() ? ", " : " and ") + parts[i];
  return report::capitalised(title);
}

}  // namespace

std::string study_html(const Study& study, const Analysis& analysis, const std::vector<Figure>& figures,
                       const StudyParameters& parameters, const Path& page_folder) {
  const Files files{tables_of(study, analysis)};
  std::string body = report::section("Primary comparison", primary_section(study, analysis, figures)) +
                     report::section("In short", overview(study, analysis));
  std::string found, pictures, tests;
  for (const Findings& f : findings_of(analysis, parameters)) {
    if (!f.sentences.empty()) found += "<h3>" + f.title + "</h3>\n" + list_of(f.sentences);
    if (f.unclear.empty()) continue;
    found += report::folded(counted(f.unclear.size(), "pair that does", "pairs that do") + " not demonstrably differ",
                            list_of(f.unclear));
  }
  body += report::section("What was found, exploratory", found);
  body += report::section("What the program noticed", findings_text(study, files));
  for (const Figure& figure : figures)
    if (figure.name != kPrimaryFigure) pictures += embedded(figure);
  body += report::section("Figures", "<div class=\"grid\">\n" + pictures + "</div>\n");
  std::string how_to_read;
  for (const CellKind kind : kKindsOfCells)
    if (const char* text = in_study(kind).how_to_read; text != nullptr && !analysis.of_cells(kind).empty())
      how_to_read += report::note(text);
  body += report::section("All measures", on_fibre_types(study) + how_to_read + measures_table(files));
  for (const Measure& m : analysis.measures)
    if (!m.comparisons.empty())
      tests += report::folded("Tests of the " + m.sample.name + " of " + name_of(m.sample.each),
                              tests_table(files, m.sample));
  body += report::section("Exploratory tests", tests + report::note("study.how-to-read"));
  body += report::section("Cells", gallery(study, page_folder) + cells_tables(files));
  return report::html_of(report::Page{.title = title_of(study), .body = body});
}

}  // namespace mbtfm::statistics
