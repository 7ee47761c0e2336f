#include "pipeline/report/error_budget.h"

#include <fmt/format.h>

#include <algorithm>

#include "pipeline/contract/numbers.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/page.h"
#include "pipeline/report/results.h"

namespace mbtfm::report {
namespace {

/// A quantity with its standard error and what each source adds to it; in squares these add up.
struct BudgetLine {
  std::optional<int> fibre_id = {};  ///< none: a sum of forces; 0: the actin network
  std::string type = {};             ///< of the fibre, or the sum's name
  double value_nN = 0, total_nN = 0;
  /// source, standard error; none where it is not known
  std::vector<std::pair<std::string, std::optional<double>>> parts_nN = {};
};

std::vector<BudgetLine> lines_of(const ErrorBudget& budget, const std::vector<Fibre>& fibres) {
  std::vector<BudgetLine> lines;
  const auto add = [&](std::optional<int> fibre_id, const std::string& type, double value_nN, const ErrorParts& parts) {
    BudgetLine& line = lines.emplace_back(BudgetLine{fibre_id, type, value_nN, total(parts)});
    for_each_part(parts, [&](const char* source, const std::optional<double>& part) {
      line.parts_nN.emplace_back(source, part);
    });
  };
  for (const TensionError& t : budget.tensions) {
    const auto fibre = std::ranges::find(fibres, t.fibre_id, &Fibre::fibre_id);
    add(t.fibre_id, fibre == fibres.end() ? "network" : mbtfm::name_of(fibre->type), t.tension_nN, t.parts_nN);
  }
  add({}, "total force", budget.total_force_nN, budget.total_force_parts_nN);
  if (budget.cut_force) add({}, "force through the cut", budget.cut_force->force_nN, budget.cut_force->parts_nN);
  return lines;
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

std::string error_budget_html(const CellResults& results) {
  if (!results.fit.error_budget) return {};
  const std::vector<BudgetLine> budget = lines_of(*results.fit.error_budget, results.cell.fibres);
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
  return html + folded("Error budget in numbers", html_of(table, {results.name + "_error_budget.csv", csv + "\n"}));
}

}  // namespace mbtfm::report
