#include "pipeline/report/stage_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/contract/version.h"
#include "pipeline/contract/words.h"
#include "pipeline/files/csv.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/page.h"

namespace mbtfm::report {
namespace {

bool is_number(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789+-.e") == text.npos;
}

enum class Truth { no, yes };
constexpr auto words(Truth) { return std::array{"FALSE", "TRUE"}; }  // as tables have it

/// As people read it: all digits before the point, three at least, and no more. The file has the others.
std::string shown(const std::string& text) {
  if (const auto truth = named<Truth>(text)) return *truth == Truth::yes ? "yes" : "no";
  if (!is_number(text) || text.find_first_of(".e") == text.npos) return text;
  const double value = std::stod(text);
  return std::abs(value) >= 100 ? fmt::format("{:.0f}", value) : fmt::format("{:#.3g}", value);
}

}  // namespace

std::string section_of(const Listing& listing) {
  const files::CsvTable csv(listing.csv, listing.name);
  Table table{.caption = listing.title};
  table.rows.resize(static_cast<std::size_t>(csv.n_rows()));
  for (const std::string& column : listing.columns) {
    std::vector<std::string> texts;
    for (int row = 0; row < csv.n_rows(); ++row) texts.push_back(csv.text(row, column));
    const auto is_empty = [](const std::string& text) { return text.empty(); };
    if (std::ranges::all_of(texts, is_empty)) continue;
    const auto may_be_number = [](const std::string& text) { return text.empty() || is_number(text); };
    table.columns.push_back({html_escaped(column), std::ranges::all_of(texts, may_be_number)});
    for (std::size_t row = 0; row < texts.size(); ++row) table.rows[row].push_back(html_escaped(shown(texts[row])));
  }
  return section(listing.title, "<p class=\"sub\">" + html_escaped(listing.explained) + "</p>\n" +
                                    html_of(table, Download{listing.name, listing.csv}));
}

std::string section_of_picture(const std::string& title, const std::string& svg_file, const std::string& explained) {
  return section(title, "<svg role=\"img\" aria-label=\"" + html_escaped(title + ". " + explained) +
                            "\" style=\"max-width:100%;height:auto\"" + svg_file.substr(svg_file.find("<svg") + 4) +
                            "<p class=\"sub\">" + html_escaped(explained) + "</p>\n");
}

std::string html_of(const StagePage& of) {
  const std::string head =
      "<h1>" + html_escaped(of.title) + "</h1><p class=\"sub\">mbtfm " + std::string(kVersion) + "</p>\n";
  std::string body = section("In short", list_of(of.facts, of.findings));
  body += section_of_picture(of.picture_title, of.picture_svg, of.picture_explained);
  for (const Listing& listing : of.tables) body += section_of(listing);
  std::vector<std::pair<std::string, std::string>> pairs;
  for (const auto& [name, value] : of.figures) pairs.emplace_back(name, text_of_figure(value));
  body += section("All figures", html_of_pairs("All figures", pairs));
  return page(of.title + " – mbtfm", head, body);
}

}  // namespace mbtfm::report
