#include "pipeline/report/stage_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>

#include "pipeline/contract/words.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/names.h"
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
  if (std::abs(value) < 1e-12) return "0";  // but for rounding
  return std::abs(value) >= 100 ? fmt::format("{:.0f}", value) : fmt::format("{:#.3g}", value);
}

}  // namespace

std::string heading_of(const std::string& column) {
  using Unit = std::pair<std::string_view, std::string_view>;
  static constexpr Unit kUnits[] = {
      {"_um_per_kPa", "µm/kPa"}, {"_nN_per_um", "nN/µm"}, {"_nN_um", "nN µm"}, {"_per_um2", "1/µm²"},
      {"_per_um3", "1/µm³"},     {"_um2", "µm²"},         {"_um", "µm"},       {"_nN", "nN"},
      {"_kPa", "kPa"},           {"_fJ", "fJ"},           {"_deg", "°"},       {"_s", "s"}};
  static constexpr std::pair<std::string_view, std::string_view> kWords[] = {
      {"sigma", "std. error"}, {"low", "lower 95 %"}, {"high", "upper 95 %"}, {"sd", "SD"}, {"p_holm", "p (Holm)"}};
  std::string name = column, unit;
  const auto* found = std::ranges::find_if(kUnits, [&](const Unit& u) { return name.ends_with(u.first); });
  if (found != std::end(kUnits)) {
    name.resize(name.size() - found->first.size());
    unit = " (" + std::string(found->second) + ")";
  }
  if (name.starts_with("n_")) name = name.substr(2);
  const auto* word = std::ranges::find(kWords, name, &Unit::first);
  if (word != std::end(kWords)) name = word->second;
  std::ranges::replace(name, '_', ' ');
  return name + unit;
}

Table table_of(const Listing& listing) {
  const files::CsvTable csv(listing.csv, listing.name);
  Table table{.caption = listing.title};
  std::vector<int> rows;
  for (int row = 0; row < csv.n_rows(); ++row)
    if (std::ranges::all_of(listing.only, [&](const auto& is) { return csv.text(row, is.first) == is.second; }))
      rows.push_back(row);
  table.rows.resize(rows.size());
  for (const std::string& part : files::parts_of(listing.columns)) {
    const bool is_of_columns = part.starts_with('*');
    const std::size_t colon = part.find(": ");
    const std::string column = part.substr(is_of_columns ? 1 : 0, colon - (is_of_columns ? 1 : 0));
    std::vector<std::string> texts;
    for (const int row : rows) texts.push_back(csv.text(row, column));
    if (std::ranges::all_of(texts, &std::string::empty)) continue;
    const auto may_be_number = [](const std::string& text) { return text.empty() || is_number(text); };
    table.columns.push_back(
        {colon == part.npos ? heading_of(column) : part.substr(colon + 2), std::ranges::all_of(texts, may_be_number)});
    for (std::size_t row = 0; row < texts.size(); ++row)
      table.rows[row].push_back(html_escaped(is_of_columns ? heading_of(texts[row]) : shown(texts[row])));
  }
  return table;
}

std::string html_of(const Listing& listing) {
  const Table table = table_of(listing);
  return table.rows.empty() ? "" : html_of(table, Download{listing.name, listing.csv});
}

std::string section_of(const Listing& listing) {
  return section(listing.title, "<p class=\"sub\">" + html_escaped(listing.explained) + "</p>\n" + html_of(listing));
}

std::string section_of_picture(const std::string& title, const std::string& svg_file, const std::string& explained) {
  return section(title, "<div class=\"scroll\"><svg role=\"img\" aria-label=\"" +
                            html_escaped(title + ". " + explained) +
                            "\" style=\"max-width:100%;min-width:34rem;height:auto\"" +
                            svg_file.substr(svg_file.find("<svg") + 4) + "</div>\n<p class=\"sub\">" +
                            html_escaped(explained) + "</p>\n");
}

std::string html_of(const StagePage& of) {
  std::string body = section("In short", list_of(of.facts, of.findings));
  body += section_of_picture(of.picture_title, of.picture_svg, of.picture_explained);
  for (const Listing& listing : of.tables) body += section_of(listing);
  std::vector<std::pair<std::string, std::string>> pairs;
  for (const auto& [name, value] : of.figures) pairs.emplace_back(heading_of(name), text_of_figure(value));
  body += section("All figures", html_of_pairs("All figures", pairs));
  return html_of(Page{.title = of.title, .body = body});
}

}  // namespace mbtfm::report
