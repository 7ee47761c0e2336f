#include "pipeline/report/stage_page.h"

#include "pipeline/contract/version.h"
#include "pipeline/files/csv.h"
#include "pipeline/report/findings.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/page.h"

namespace mbtfm::report {
namespace {

bool is_number(const std::string& text) {
  return !text.empty() && text.find_first_not_of("0123456789+-.e") == text.npos;
}

}  // namespace

std::string section_of(const Listing& listing) {
  const files::CsvTable csv(listing.csv, listing.name);
  Table table{.columns = {}, .rows = {}, .caption = listing.title};
  for (const std::string& column : listing.columns) table.columns.push_back({html_escaped(column), true});
  for (int row = 0; row < csv.n_rows(); ++row) {
    std::vector<std::string>& cells = table.rows.emplace_back();
    for (std::size_t k = 0; k < listing.columns.size(); ++k) {
      const std::string text = csv.text(row, listing.columns[k]);
      if (!text.empty() && !is_number(text)) table.columns[k].is_number = false;
      cells.push_back(html_escaped(text));
    }
  }
  return section(listing.title, "<p class=\"sub\">" + html_escaped(listing.explained) + "</p>\n" +
                                    html_of(table, Download{listing.name, listing.csv}));
}

std::string picture_in_page(const std::string& svg_file, const std::string& name) {
  return "<svg role=\"img\" aria-label=\"" + html_escaped(name) + "\" style=\"max-width:100%;height:auto\"" +
         svg_file.substr(svg_file.find("<svg") + 4);
}

std::string html_of(const StagePage& of) {
  const std::string head =
      "<h1>" + html_escaped(of.title) + "</h1><p class=\"sub\">mbtfm " + std::string(kVersion) + "</p>\n";
  std::string body = section("In short", list_of(of.facts, of.findings));
  body += section(of.picture_title, picture_in_page(of.picture_svg, of.picture_title + ". " + of.picture_explained) +
                                        "<p class=\"sub\">" + html_escaped(of.picture_explained) + "</p>\n");
  for (const Listing& listing : of.tables) body += section_of(listing);
  std::vector<std::pair<std::string, std::string>> pairs;
  for (const auto& [name, value] : of.figures) pairs.emplace_back(name, text_of_figure(value));
  body += section("All figures", html_of_pairs("All figures", pairs));
  return page(of.title + " – mbtfm", head, body);
}

}  // namespace mbtfm::report
