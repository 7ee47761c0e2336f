#include <algorithm>
#include <cmath>

#include "mbtfm/plan/answer.h"
#include "mbtfm/plan/tables.h"
#include "pipeline/charts/chart.h"
#include "pipeline/contract/version.h"
#include "pipeline/report/page.h"

namespace mbtfm::plan {
namespace {

using report::number;

/// What is said of flat cells and of cells in space in other words.
struct Texts {
  std::string beads, middle, of_middle, drawn, drawn_explained, how;
};

const Texts& texts_of(const Plan&) {
  static const Texts texts = {
      .beads = "beads per µm²",
      .middle = "middle fibre",
      .of_middle = "tension",
      .drawn = "tension",
      .drawn_explained =
          "Tensions found in simulated experiments beside the true ones. The fits know neither the cell's own network "
          "nor its tensions.",
      .how =
          "<p class=\"sub\">The error by the beads is the Cramér–Rao bound of the fit: it grows in proportion to "
          "noise and modulus and falls with the root of the density. The model's part (meshes, segmentation, what is "
          "missing in the model) is the same for all of them: it is where the curves level off. “Never” means that "
          "this part alone is larger than the target.</p>\n"};
  return texts;
}

const Texts& texts_of(const SpacePlan&) {
  static const Texts texts = {
      .beads = "beads per µm³",
      .middle = "middle patch",
      .of_middle = "force",
      .drawn = "component of a force",
      .drawn_explained = "Forces found in simulated experiments beside the true ones, by component.",
      .how =
          "<p class=\"sub\">Standard errors are those that the reconstruction states, with lambda as data of this "
          "noise choose it. A modulus counts as noise does. More noise makes lambda larger, so that the error grows "
          "less than the noise. “By background” is the part by tractions beside the patches that the beads do not "
          "tell from them.</p>\n"};
  return texts;
}

Quantity drawn_quantity(const Plan& plan) {
  return plan.grid.needed.empty() ? Quantity::total_force : Quantity::fibres;
}
SpaceQuantity drawn_quantity(const SpacePlan&) { return SpaceQuantity::force; }

/// Said after a point's numbers.
std::string further_of(const Expected& e) {
  return "; " + brief(100 * e.share_within) + " % of the fibres are within the target";
}
std::string further_of(const SpaceExpected&) { return {}; }

std::string colour(std::size_t k) { return charts::kColours[k % std::size(charts::kColours)]; }

std::string dashed(const Asked& asked) { return "Dashed: the target of " + brief(asked.target_nN) + " nN."; }

/// Standard error over density at one noise, a curve for each gel, the target as a line.
template <class Quantity>
charts::Chart error_chart(const PlanOf<Quantity>& plan, double noise_um) {
  const Quantity quantity = drawn_quantity(plan);
  const Texts& texts = texts_of(plan);
  const Asked& asked = plan.asked;
  std::vector<double> errors = {asked.target_nN};  // of all noises, so that the axes are alike
  for (const auto& e : plan.grid.expected)
    if (e.quantity == quantity) errors.push_back(e.standard_error_nN);
  charts::Chart chart(
      "Noise " + brief(noise_um) + " µm", charts::axis_over(texts.beads, asked.densities, charts::Scale::logarithmic),
      charts::axis_over("standard error of the " + texts.middle + " (nN)", errors, charts::Scale::logarithmic));
  for (std::size_t k = 0; k < asked.youngs_modulus_kPa.size(); ++k) {
    const std::string gel = brief(asked.youngs_modulus_kPa[k]) + " kPa";
    std::vector<Vec2> points;
    for (const auto& e : plan.grid.expected) {
      if (e.quantity != quantity || e.point.youngs_modulus_kPa != asked.youngs_modulus_kPa[k]) continue;
      if (e.point.noise_um != noise_um) continue;
      points.push_back({e.point.density, e.standard_error_nN});
      chart.dot(points.back(), 3.5, "fill:" + colour(k) + ";stroke:#fff",
                gel + ", " + brief(e.point.density) + " " + texts.beads + ": " + brief(e.standard_error_nN) +
                    " nN, of which " + brief(e.from_beads_nN) + " by the beads" + further_of(e));
    }
    chart.curve(points, "fill:none;stroke-width:2;stroke:" + colour(k));
    chart.key(gel, colour(k));
  }
  chart.level(asked.target_nN, "stroke:#333;stroke-width:1.5;stroke-dasharray:6 4");
  return chart;
}

template <class Quantity>
std::vector<charts::Chart> charts_of(const PlanOf<Quantity>& plan) {
  std::vector<charts::Chart> charts;
  for (const double noise_um : plan.asked.noise_um) charts.push_back(error_chart(plan, noise_um));
  return charts;
}

std::string needed_text(const Plan& plan, const Needed& n) {
  if (!n.density) return "never";
  return *n.density > plan.most_beads_per_um2 ? "&gt; " + brief(plan.most_beads_per_um2)
                                              : density_text(plan.asked.densities, *n.density);
}
std::string needed_text(const SpacePlan& plan, const Needed& n) {
  return n.density ? density_text(plan.asked.densities, *n.density)
                   : "&gt; " + about(most_beads_per_um3(plan.asked.densities));
}

std::string below_needed(const Plan& plan) {
  return "<p class=\"sub\">&gt; " + brief(plan.most_beads_per_um2) +
         ": more beads than can be told apart. “never”: no number of beads suffices.</p>\n";
}
std::string below_needed(const SpacePlan&) { return {}; }

report::Table expected_rows(const Plan& plan) {
  report::Table table{.columns = {number("gel (kPa)"), number("beads per µm²"), number("noise (µm)"), "quantity",
                                  number("number"), number("standard error (nN)"), number("by beads"),
                                  number("by mesh"), number("by segmentation"), number("by the rest"),
                                  number("within target (%)"), number("two apart from (µm)")}};
  for (const Expected& e : plan.grid.expected) {
    table.rows.push_back({brief(e.point.youngs_modulus_kPa), brief(e.point.density), brief(e.point.noise_um),
                          name_of(e.quantity), std::to_string(e.n), brief(e.standard_error_nN), brief(e.from_beads_nN),
                          brief(e.from_mesh_nN), brief(e.from_segmentation_nN), brief(e.from_other_nN),
                          brief(100 * e.share_within), e.least_distance_um ? brief(*e.least_distance_um) : "–"});
  }
  return table;
}

report::Table expected_rows(const SpacePlan& plan) {
  report::Table table{.columns = {number("gel (kPa)"), number("beads per µm³"), number("noise (µm)"), "quantity",
                                  number("number"), number("standard error (nN)"), number("by beads"),
                                  number("by background"), number("within target (%)"), number("map resolves (µm)"),
                                  number("two told from (µm)"), number("numbers told")}};
  for (const SpaceExpected& e : plan.grid.expected) {
    table.rows.push_back({brief(e.point.youngs_modulus_kPa), brief(e.point.density), brief(e.point.noise_um),
                          name_of(e.quantity), std::to_string(e.n), brief(e.standard_error_nN), brief(e.from_beads_nN),
                          brief(e.from_background_nN), brief(100 * e.share_within),
                          e.resolution_um ? brief(*e.resolution_um) : "–",
                          e.least_distance_um ? brief(*e.least_distance_um) : "–", brief(e.degrees)});
  }
  return table;
}

report::Table cell_rows(const std::vector<CellNumbers>& cells) {
  report::Table table{.columns = {"type", number("mean (nN)"), number("between cells (nN)"), number("within (nN)"),
                                  number("error (nN)"), number("difference (%)"), number("fibres per cell"),
                                  number("cells of each condition")}};
  for (const int n : kCells) table.columns.push_back(number("chance with " + std::to_string(n) + " cells (%)"));
  for (const CellNumbers& n : cells) {
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

std::string name_of_number(const Plan&, const DrawnNumber& d) { return "fibre " + std::to_string(d.id); }
std::string name_of_number(const SpacePlan&, const DrawnNumber& d) {
  return "patch " + std::to_string(d.id) + ", " + name_of(d.component);
}

/// Numbers as drawn experiments found them.
template <class Quantity>
charts::Chart drawn_chart(const PlanOf<Quantity>& plan) {
  const std::vector<DrawnNumber>& numbers = plan.drawn->numbers;
  std::vector<double> both;
  for (const DrawnNumber& d : numbers) both.insert(both.end(), {d.true_nN, d.found_nN});
  charts::Chart chart("Drawn experiments",
                      charts::axis_over("true " + texts_of(plan).drawn + " (nN)", both, charts::Scale::linear),
                      charts::axis_over("found, ± predicted standard error (nN)", both, charts::Scale::linear));
  const auto [least, most] = std::ranges::minmax(both);
  const double from = std::min(0.0, least);
  chart.curve({{from, from}, {most, most}}, "fill:none;stroke:#999;stroke-width:1");
  for (const DrawnNumber& d : numbers) {
    const std::string of = colour(static_cast<std::size_t>(d.experiment));
    chart.error({d.true_nN, d.found_nN - d.predicted_error_nN}, {d.true_nN, d.found_nN + d.predicted_error_nN},
                "stroke-width:1;stroke:" + of);
    chart.dot({d.true_nN, d.found_nN}, 3, "fill:" + of + ";stroke:#fff",
              name_of_number(plan, d) + ": true " + brief(d.true_nN) + " nN, found " + brief(d.found_nN) + " ± " +
                  brief(d.predicted_error_nN) + " nN");
  }
  return chart;
}

/// By gel and noise.
template <class Quantity>
report::Table needed_rows(const PlanOf<Quantity>& plan) {
  report::Table table{.columns = {number("gel (kPa)")}};
  for (const double noise_um : plan.asked.noise_um) table.columns.push_back(number("noise " + brief(noise_um) + " µm"));
  for (const double E : plan.asked.youngs_modulus_kPa) {
    std::vector<std::string> row = {brief(E)};
    for (const Needed& n : plan.grid.needed)
      if (n.youngs_modulus_kPa == E) row.push_back(needed_text(plan, n));
    table.rows.push_back(std::move(row));
  }
  return table;
}

std::string paragraphs(const std::vector<std::string>& texts) {
  std::string html;
  for (const std::string& text : texts) html += "<p>" + report::html_escaped(text) + "</p>\n";
  return html;
}

}  // namespace

template <class Quantity>
std::string svg_of(const PlanOf<Quantity>& plan) {
  const Texts& texts = texts_of(plan);
  const std::vector<charts::Chart> charts = charts_of(plan);
  return charts::svg_file(
      charts, std::min<int>(2, static_cast<int>(charts.size())),
      {plan.name + ": standard error of the " + texts.middle + "'s " + texts.of_middle + ".", dashed(plan.asked)});
}

template <class Quantity>
std::string html_of(const PlanOf<Quantity>& plan) {
  const Texts& texts = texts_of(plan);
  const std::string head = "<h1>Plan: " + report::html_escaped(plan.name) + "</h1><p class=\"sub\">mbtfm " +
                           std::string(kVersion) + "</p>\n<p><b>" + report::html_escaped(answer_sentence(plan)) +
                           "</b></p>\n" + paragraphs(further_sentences(plan));
  std::string body, figures;
  if (!plan.grid.warnings.empty()) body += report::section("What to mind", paragraphs(plan.grid.warnings));
  for (const charts::Chart& chart : charts_of(plan)) figures += report::figure(chart, dashed(plan.asked));
  body += report::section("Standard error over density", figures + texts.how);
  if (!plan.grid.needed.empty())
    body += report::section(
        report::capitalised(texts.beads) + " that are needed",
        report::html_of(needed_rows(plan),
                        {"plan_needed.csv", files::text_of(needed_table(Quantity{}), plan.grid.needed)}) +
            below_needed(plan));
  if (plan.drawn && !plan.drawn->numbers.empty())
    body += report::section("How well it held", report::figure(drawn_chart(plan), texts.drawn_explained));
  if (!plan.cells.empty())
    body += report::section(
        "How many cells",
        report::html_of(cell_rows(plan.cells), {"plan_cells.csv", files::text_of(cell_table(), plan.cells)}) +
            "<p class=\"sub\">Two-sided t test at 5 % of the means of two groups of cells. Scatter: " +
            report::html_escaped(plan.cells.front().scatter.source) + ".</p>\n");
  body += report::section(
      "All numbers", report::html_of(expected_rows(plan),
                                     {"plan.csv", files::text_of(expected_table(Quantity{}), plan.grid.expected)}));
  return report::page("Plan – mbtfm", head, body);
}

template std::string svg_of(const Plan&);
template std::string svg_of(const SpacePlan&);
template std::string html_of(const Plan&);
template std::string html_of(const SpacePlan&);

}  // namespace mbtfm::plan
