#include "mbtfm/plan/page.h"

#include <cmath>

#include "mbtfm/plan/answer.h"
#include "mbtfm/plan/page_parts.h"
#include "mbtfm/plan/tables.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::plan {

namespace {

std::vector<Expected> rows_of(const Grid& grid, double youngs_modulus_kPa, double noise_um, Quantity quantity) {
  std::vector<Expected> rows;
  for (const Expected& e : grid.expected) {
    if (e.quantity == quantity && e.point.youngs_modulus_kPa == youngs_modulus_kPa && e.point.noise_um == noise_um)
      rows.push_back(e);
  }
  return rows;
}

Quantity drawn_quantity(const Plan& plan) {
  return plan.grid.needed.empty() ? Quantity::total_force : Quantity::fibres;
}

charts::Chart chart_of(const Plan& plan, double noise_um) {
  const Quantity quantity = drawn_quantity(plan);
  std::vector<double> errors;
  for (const Expected& e : plan.grid.expected)
    if (e.quantity == quantity) errors.push_back(e.standard_error_nN);
  return error_chart(
      plan.asked, noise_um, "beads per µm²", plan.asked.beads_per_um2, "middle fibre", std::move(errors),
      [&](double E) {
        std::vector<ErrorDot> dots;
        for (const Expected& e : rows_of(plan.grid, E, noise_um, quantity))
          dots.push_back({e.point.beads_per_um2, e.standard_error_nN, e.from_beads_nN,
                          "; " + brief(100 * e.share_within) + " % of the fibres are within the target"});
        return dots;
      });
}

std::string needed_text(const Plan& plan, const Needed& n) {
  if (!n.beads_per_um2) return "never";
  return *n.beads_per_um2 > plan.most_beads_per_um2 ? "&gt; " + brief(plan.most_beads_per_um2)
                                                    : density_text(plan.asked.beads_per_um2, *n.beads_per_um2);
}

report::Table expected_rows(const Plan& plan) {
  report::Table table{.columns = {number("gel (kPa)"), number("beads per µm²"), number("noise (µm)"), "quantity",
                                  number("number"), number("standard error (nN)"), number("by beads"),
                                  number("by mesh"), number("by segmentation"), number("by the rest"),
                                  number("within target (%)"), number("two apart from (µm)")}};
  for (const Expected& e : plan.grid.expected) {
    table.rows.push_back({brief(e.point.youngs_modulus_kPa), brief(e.point.beads_per_um2), brief(e.point.noise_um),
                          name_of(e.quantity), std::to_string(e.n), brief(e.standard_error_nN), brief(e.from_beads_nN),
                          brief(e.from_mesh_nN), brief(e.from_segmentation_nN), brief(e.from_other_nN),
                          brief(100 * e.share_within), e.least_distance_um ? brief(*e.least_distance_um) : "–"});
  }
  return table;
}

report::Table cell_rows(const Plan& plan) {
  report::Table table{.columns = {"type", number("mean (nN)"), number("between cells (nN)"), number("within (nN)"),
                                  number("error (nN)"), number("difference (%)"), number("fibres per cell"),
                                  number("cells of each condition")}};
  for (const int cells : kCells) table.columns.push_back(number("chance with " + std::to_string(cells) + " cells (%)"));
  for (const CellNumbers& n : plan.cells) {
    std::vector<std::string> row = {
        name_of(n.scatter.type),           brief(n.scatter.mean_nN),
        brief(n.scatter.between_cells_nN), brief(n.scatter.within_nN),
        brief(n.scatter.error_nN),         brief(100 * n.difference),
        brief(n.fibres_per_cell),          n.cells ? std::to_string(*n.cells) : "&gt; 10000"};
    for (const double p : n.power) row.push_back(brief(std::round(100 * p)));
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::vector<DrawnDot> drawn_dots(const Drawn& drawn) {
  std::vector<DrawnDot> dots;
  for (const DrawnTension& t : drawn.tensions)
    dots.push_back({t.true_nN, t.found_nN, t.predicted_error_nN, t.experiment, "fibre " + std::to_string(t.fibre_id)});
  return dots;
}

constexpr const char* kHow =
    "<p class=\"sub\">The error by the beads is the Cramér–Rao bound of the fit: it grows in proportion to noise and "
    "modulus and falls with the root of the density. The model's part (meshes, segmentation, what is missing in the "
    "model) is the same for all of them: it is where the curves level off. “Never” means that this part alone is "
    "larger than the target.</p>\n";

}  // namespace

std::vector<charts::Chart> charts_of(const Plan& plan) {
  std::vector<charts::Chart> charts;
  for (const double noise_um : plan.asked.noise_um) charts.push_back(chart_of(plan, noise_um));
  return charts;
}

std::string svg_of(const Plan& plan) {
  return svg_of(charts_of(plan), plan.name + ": standard error of the middle fibre's tension.", plan.asked);
}

std::string html_of(const Plan& plan) {
  const std::string head = head_of(plan.name, answer_sentence(plan), further_sentences(plan));
  std::string body;
  if (!plan.grid.warnings.empty()) body += report::section("What to mind", paragraphs(plan.grid.warnings));
  body += report::section("Standard error over density", figures_of(charts_of(plan), plan.asked) + kHow);
  if (!plan.grid.needed.empty())
    body += report::section("Beads per µm² that are needed",
                            report::html_of(needed_rows<Needed>(plan.asked, plan.grid.needed,
                                                                [&](const Needed& n) { return needed_text(plan, n); }),
                                            {"plan_needed.csv", files::text_of(needed_table(), plan.grid.needed)}) +
                                "<p class=\"sub\">&gt; " + brief(plan.most_beads_per_um2) +
                                ": more beads than can be told apart. “never”: no number of beads suffices.</p>\n");
  if (plan.drawn && !plan.drawn->tensions.empty())
    body += report::section("How well it held",
                            report::figure(drawn_chart("tension", drawn_dots(*plan.drawn)),
                                           "Tensions found in simulated experiments beside the true ones. The fits "
                                           "know neither the cell's own network nor its tensions."));
  if (!plan.cells.empty())
    body +=
        report::section("How many cells",
                        report::html_of(cell_rows(plan), {"plan_cells.csv", files::text_of(cell_table(), plan.cells)}) +
                            "<p class=\"sub\">Two-sided t test at 5 % of the means of two groups of cells. Scatter: " +
                            report::html_escaped(plan.cells.front().scatter.source) + ".</p>\n");
  body += report::section(
      "All numbers",
      report::html_of(expected_rows(plan), {"plan.csv", files::text_of(expected_table(), plan.grid.expected)}));
  return report::page("Plan – mbtfm", head, body);
}

}  // namespace mbtfm::plan
