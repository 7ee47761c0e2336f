#include "pipeline/report/tension_table.h"

#include <fmt/format.h>

#include "pipeline/numerics/order_statistics.h"
#include "pipeline/report/compare.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/results.h"
#include "pipeline/report/tension_plot.h"

namespace mbtfm::report {
namespace {

std::string type_cell(FibreType type) {
  return "<span class=\"keep\">" + swatch_of(type, colour_of(type)) + full_name_of(type) + "</span>";
}

/// Half of the 95 % interval. Its upper half: the lower one may be cut at zero.
std::optional<double> half_interval_nN(const Tension& t) {
  if (!t.high_nN || !(*t.high_nN > t.tension_nN)) return {};
  return *t.high_nN - t.tension_nN;
}

/// Decimals that suit most fibres: those of the median error. None: as many as each number needs.
std::optional<int> common_decimals(const std::vector<FibreRow>& rows) {
  std::vector<double> errors;
  for (const FibreRow& row : rows)
    if (const auto half = half_interval_nN(row.tension)) errors.push_back(*half);
  if (errors.empty()) return {};
  return decimals_for(numerics::median_in(errors));
}

std::string interval_cell(const Tension& t, std::optional<int> decimals) {
  if (!t.identifiable) return "<b>not identifiable</b>";
  if (!t.low_nN || !t.high_nN) return "–";
  return rounded(*t.low_nN, decimals) + " – " + rounded(*t.high_nN, decimals);
}

/// Truth, error in per cent, error in halves of the interval.
std::vector<std::string> truth_cells(const Tension& t, const std::optional<double>& truth_nN,
                                     std::optional<int> decimals) {
  if (!truth_nN) return {"–", "–", "–"};
  const double error_nN = t.tension_nN - *truth_nN;
  const auto half_nN = half_interval_nN(t);
  // one decimal more than the fit deserves: the truth has no error
  return {rounded(*truth_nN, decimals ? std::optional(*decimals + 1) : std::nullopt),
          *truth_nN > 0 ? with_sign(100 * error_nN / *truth_nN, 0) : "–",
          half_nN ? with_sign(error_nN / *half_nN, 1) : "–"};
}

std::string true_fibre_cell(const FibreRow& row) {
  if (!row.true_fibre_id) return "none";
  std::string cell = std::to_string(*row.true_fibre_id);
  if (row.true_type && *row.true_type != row.fibre->type)
    cell += fmt::format(", <b>{}</b>", full_name_of(*row.true_type));
  return cell;
}

/// The adhesions that hold the fibre.
std::string ends_cell(const Fibre& fibre) {
  std::string cell;
  for (const auto& id : {fibre.start_adhesion_id, fibre.end_adhesion_id})
    if (id) cell += (cell.empty() ? "" : ", ") + std::to_string(*id);
  return cell.empty() ? "–" : cell;
}

std::vector<std::string> network_row(const CellResults& results, const Tension& t) {
  const auto half_nN = half_interval_nN(t);
  const std::optional<int> decimals = half_nN ? std::optional(decimals_for(*half_nN)) : std::nullopt;
  std::vector<std::string> row = {"0", "actin network (one cable)", rounded(t.tension_nN, decimals),
                                  interval_cell(t, decimals)};
  if (results.comparison) {
    for (auto& cell : truth_cells(t, results.comparison->true_network_nN, decimals)) row.push_back(cell);
    row.push_back("–");
  }
  row.insert(row.end(), {"–", "all"});
  return row;
}

/// The true fibres that no found one stands for, as a sentence.
std::string missed_fibres(const Comparison& comparison) {
  std::string list;
  for (const ComparedFibre& fibre : comparison.fibres) {
    if (fibre.found) continue;
    list += fmt::format("{}{} ({}, {} nN, {} µm)", list.empty() ? "" : ", ", fibre.truth->fibre_id,
                        full_name_of(fibre.truth->type), rounded(fibre.true_tension_nN, {}),
                        readable(length_um(fibre.truth->points_um)));
  }
  return list.empty() ? "" : "<p class=\"sub\">True fibres that were not found: " + list + ".</p>\n";
}

}  // namespace

Table tension_table(const CellResults& results) {
  Table table{
      {number("fibre"), "type", number("tension (nN)"), number("95 % interval (nN)")}, {}, "Tension of each fibre"};
  const bool has_truth = results.comparison.has_value();
  if (has_truth)
    for (const char* title : {"truth (nN)", "error (%)", "error / half interval", "true fibre"})
      table.columns.push_back(number(title));
  table.columns.push_back(number("length (µm)"));
  table.columns.push_back("adhesions");
  if (const auto t = results.tensions.find(0); t != results.tensions.end())
    table.rows.push_back(network_row(results, t->second));
  const std::vector<FibreRow> rows = fibre_rows(results);
  const std::optional<int> decimals = common_decimals(rows);
  for (const FibreRow& fibre : rows) {
    std::vector<std::string> row = {std::to_string(fibre.fibre->fibre_id), type_cell(fibre.fibre->type),
                                    rounded(fibre.tension.tension_nN, decimals),
                                    interval_cell(fibre.tension, decimals)};
    if (has_truth) {
      for (auto& cell : truth_cells(fibre.tension, fibre.true_tension_nN, decimals)) row.push_back(cell);
      row.push_back(true_fibre_cell(fibre));
    }
    row.push_back(fmt::format("{:.1f}", length_um(fibre.fibre->points_um)));
    row.push_back(ends_cell(*fibre.fibre));
    table.rows.push_back(row);
  }
  return table;
}

std::string tension_notes(const CellResults& results) {
  std::string html = fmt::format(
      "<p class=\"sub\">The tension of the actin network is that of one cable of the mesh; as a surface tension it is "
      "{} nN/µm, which does not depend on the mesh.",
      readable(results.fit.network_surface_tension_nN_per_um));
  if (results.comparison) {
    html +=
        " Error: fitted minus true tension, in per cent of the truth and in halves of the 95 % interval: between −1 "
        "and +1 the interval holds the truth.";
  }
  html += "</p>\n";
  return results.comparison ? html + missed_fibres(*results.comparison) : html;
}

Coverage coverage_of(const CellResults& results) {
  Coverage coverage;
  for (const FibreRow& row : fibre_rows(results)) {
    const Tension& t = row.tension;
    if (!t.identifiable || !t.low_nN || !t.high_nN || !row.true_tension_nN) continue;
    ++coverage.n;
    if (*row.true_tension_nN >= *t.low_nN && *row.true_tension_nN <= *t.high_nN) ++coverage.n_inside;
  }
  return coverage;
}

}  // namespace mbtfm::report
