#include "pipeline/report/error_budget.h"

#include <fmt/format.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "pipeline/contract/numbers.h"
#include "pipeline/files/json_record.h"
#include "pipeline/files/own_files.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/page.h"

namespace mbtfm::report {
namespace {

BudgetLine line_of(const files::JsonRecord& record, const char* value) {
  BudgetLine line{.value_nN = record.at(value).number(), .total_nN = record.at("total_nN").number()};
  for (const auto& [source, part] : record.at("parts_nN").members())
    line.parts_nN.emplace_back(source, part.json().is_null() ? std::nullopt : std::optional(part.number()));
  return line;
}

/// The table has a column for each source of the first line.
void expect_same_sources(const files::JsonRecord& record, const BudgetLine& line, const BudgetLine& first) {
  const bool is_same = std::ranges::equal(line.parts_nN, first.parts_nN,
                                          [](const auto& a, const auto& b) { return a.first == b.first; });
  if (!is_same) record.at("parts_nN").fail("of the same sources as the first");
}

std::string name_of(const BudgetLine& line) {
  if (!line.fibre_id) return line.type;
  return *line.fibre_id == 0 ? "network" : fmt::format("{} {}", line.type, *line.fibre_id);
}

/// The sources' colours, in the order of the parts.
const char* colour(std::size_t i) { return charts::kColours[i % std::size(charts::kColours)]; }

std::string share_text(const BudgetLine& line, const std::string& source, double part_nN) {
  return fmt::format("{}: {} ± {} nN\n{}: {} nN, {:.0f} % of the squared error", name_of(line), readable(line.value_nN),
                     readable(line.total_nN), source, readable(part_nN),
                     100 * part_nN * part_nN / (line.total_nN * line.total_nN));
}

/// A bar as long as the standard error, each source's piece by its share of the square.
charts::Chart chart_of(const std::vector<BudgetLine>& lines) {
  double longest = 0;
  std::vector<std::string> names;
  for (const BudgetLine& line : lines) {
    longest = std::max(longest, line.total_nN);
    names.push_back(name_of(line));
  }
  charts::Chart chart("Where the errors come from",
                      {"standard error of the tension (nN)", 0, longest > 0 ? 1.03 * longest : 1},
                      charts::row_axis(names));
  constexpr double kRow_px = 19;
  chart.frame_height(kRow_px * static_cast<double>(lines.size()));
  for (std::size_t i = 0; i < lines.size(); ++i) {
    double from_nN = 0;
    for (std::size_t k = 0; k < lines[i].parts_nN.size(); ++k) {
      const auto& [source, part_nN] = lines[i].parts_nN[k];
      if (!part_nN || !(*part_nN > 0) || !(lines[i].total_nN > 0)) continue;
      const double to_nN = from_nN + *part_nN * *part_nN / lines[i].total_nN;
      const double row = static_cast<double>(i);
      chart.bar({from_nN, row - 0.33}, {to_nN, row + 0.33}, std::string("fill:") + colour(k),
                share_text(lines[i], source, *part_nN));
      from_nN = to_nN;
    }
  }
  if (!lines.empty())
    for (std::size_t k = 0; k < lines.front().parts_nN.size(); ++k)
      chart.key(lines.front().parts_nN[k].first, colour(k));
  return chart;
}

}  // namespace

std::vector<BudgetLine> read_error_budget(const std::filesystem::path& run_file) {
  std::vector<BudgetLine> lines;
  if (!files::is_own_file(run_file)) return lines;
  const files::JsonRecord run(run_file, "a run.json as mbtfm run writes it",
                              "delete it; if that does not help, 4_fit/fit.json, too");
  const auto budget = run.find("error_budget");
  if (!budget) return lines;
  const auto add = [&](const files::JsonRecord& record, BudgetLine line) {
    if (!lines.empty()) expect_same_sources(record, line, lines.front());
    lines.push_back(std::move(line));
  };
  const auto add_sum = [&](const files::JsonRecord& record, const char* name, const char* value) {
    BudgetLine line = line_of(record, value);
    line.type = name;
    add(record, std::move(line));
  };
  for (const files::JsonRecord& fibre : budget->at("fibres").list()) {
    BudgetLine line = line_of(fibre, "tension_nN");
    line.fibre_id = fibre.at("fibre_id").integer();
    line.type = fibre.at("type").text();
    add(fibre, std::move(line));
  }
  if (const auto force = budget->find("total_force")) add_sum(*force, "total force", "total_force_nN");
  if (const auto force = budget->find("cut_force")) add_sum(*force, "force through the cut", "cut_force_nN");
  return lines;
}

std::string error_budget_html(const std::vector<BudgetLine>& budget, const std::string& cell) {
  if (budget.empty()) return {};
  std::vector<BudgetLine> fibres;
  Table table{{"of", number("value (nN)"), number("standard error (nN)")}, {}, "Error budget"};
  std::string csv = "fibre_id,type,value_nN,total_nN";
  for (const auto& [source, part] : budget.front().parts_nN) {
    table.columns.push_back(number(source + " (nN)"));
    csv += "," + source + "_nN";
  }
  for (const BudgetLine& line : budget) {
    // the network's tension is that of a cable, hundreds of times smaller
    if (line.fibre_id && *line.fibre_id > 0) fibres.push_back(line);
    std::vector<std::string> row = {html_escaped(name_of(line)), readable(line.value_nN), readable(line.total_nN)};
    csv += fmt::format("\n{},{},{},{}", line.fibre_id ? std::to_string(*line.fibre_id) : "", line.type,
                       shortest(line.value_nN), shortest(line.total_nN));
    for (const auto& [source, part] : line.parts_nN) {
      row.push_back(part ? readable(*part) : "–");
      csv += "," + (part ? shortest(*part) : std::string());
    }
    table.rows.push_back(std::move(row));
  }
  std::ranges::stable_sort(fibres, [](const BudgetLine& a, const BudgetLine& b) { return a.total_nN > b.total_nN; });
  std::string html = "<div class=\"grid\">" +
                     figure(chart_of(fibres),
                            "The largest first. A bar is as long as the standard error; the sources’ squares add up, "
                            "so each has the share of the bar that it has of the square.") +
                     "</div>\n";
  return html + folded("Error budget in numbers", html_of(table, {cell + "_error_budget.csv", csv + "\n"}));
}

}  // namespace mbtfm::report
