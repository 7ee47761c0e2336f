#include <algorithm>

#include "pipeline/charts/chart.h"
#include "pipeline/contract/counted.h"
#include "pipeline/report/stage_page.h"
#include "pipeline/report/texts.h"
#include "samples/plan/answer.h"
#include "samples/plan/tables.h"

namespace mbtfm::plan {
namespace {

using report::number;

/// What is said of flat cells and of cells in space in other words.
struct Texts {
  std::string beads, middle, of_middle, drawn, drawn_explained, how, density, further;
};

const Texts& texts_of(const Plan&) {
  static const Texts texts = {.beads = "beads per µm²",
                              .middle = "middle fibre",
                              .of_middle = "tension",
                              .drawn = "tension",
                              .drawn_explained = report::sentence("plan.drawn"),
                              .how = report::note("plan.curves"),
                              .density = "beads_per_um2",
                              .further = report::sentence("plan.columns-of-errors")};
  return texts;
}

const Texts& texts_of(const SpacePlan&) {
  static const Texts texts = {.beads = "beads per µm³",
                              .middle = "middle patch",
                              .of_middle = "force",
                              .drawn = "component of a force",
                              .drawn_explained = report::sentence("plan.drawn-in-space"),
                              .how = report::note("plan.curves-in-space"),
                              .density = "beads_per_um3",
                              .further = report::sentence("plan.columns-of-errors-in-space")};
  return texts;
}

Quantity drawn_quantity(const Plan& plan) {
  return plan.grid.needed.empty() ? Quantity::total_force : Quantity::fibres;
}
SpaceQuantity drawn_quantity(const SpacePlan&) { return SpaceQuantity::force; }

/// Said after a point's numbers.
std::string further_of(const Expected& e) {
  return report::sentence("plan.within-target", brief(100 * e.share_within));
}
std::string further_of(const SpaceExpected&) { return {}; }

std::string colour(std::size_t k) { return charts::kColours[k % std::size(charts::kColours)]; }

std::string dashed(const Asked& asked) { return report::sentence("plan.target", brief(asked.target_nN)); }

/// Standard error over density at one noise, a curve for each gel, the target as a line.
template <class Quantity>
charts::Chart error_chart(const PlanOf<Quantity>& plan, double noise_um) {
  const Quantity quantity = drawn_quantity(plan);
  const Texts& texts = texts_of(plan);
  const Asked& asked = plan.asked;
  std::vector<double> errors = {asked.target_nN};  // of all noises, so that the axes are alike
  for (const auto& e : plan.grid.expected)
    if (e.quantity == quantity) errors.push_back(e.standard_error_nN);
  charts::Chart chart("Noise " + brief(noise_um) + " µm",
                      charts::axis_over(texts.beads, asked.densities, charts::Scale::logarithmic),
                      charts::axis_over("standard error (nN)", errors, charts::Scale::logarithmic));
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

std::string below_needed(const Plan& plan) { return report::note("plan.never", brief(plan.most_beads_per_um2)); }
std::string below_needed(const SpacePlan&) { return {}; }

template <class Row>
report::Listing listing_of(const char* title, const char* file, const files::Table<Row>& table,
                           const std::vector<Row>& rows, const std::string& columns) {
  return {title, {}, file, text_of(table, rows), columns};
}

template <class Quantity>
report::Listing expected_listing(const PlanOf<Quantity>& plan) {
  const Texts& texts = texts_of(plan);
  return listing_of("All numbers", "plan.csv", expected_table(Quantity{}), plan.grid.expected,
                    report::sentence("plan.columns", texts.density, texts.beads, texts.further));
}

report::Listing cell_listing(const std::vector<CellNumbers>& cells) {
  std::string columns = report::sentence("plan.columns-of-cells");
  for (const int n : kCells)
    columns += ", power_of_" + std::to_string(n) + "_cells: power with " + std::to_string(n) + " cells";
  return listing_of("How many cells", "plan_cells.csv", cell_table(), cells, columns);
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
                      charts::axis_over("found (nN)", both, charts::Scale::linear));
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
  report::Table table{.caption = "Beads that are needed", .columns = {number("gel (kPa)")}};
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

std::string grid(const std::string& figures) { return "<div class=\"grid\">\n" + figures + "</div>\n"; }

}  // namespace

template <class Quantity>
std::string svg_of(const PlanOf<Quantity>& plan) {
  const Texts& texts = texts_of(plan);
  const std::vector<charts::Chart> charts = charts_of(plan);
  return charts::svg_file(
      charts, std::min<int>(2, static_cast<int>(charts.size())),
      {report::sentence("plan.picture", plan.name, texts.middle, texts.of_middle), dashed(plan.asked)});
}

template <class Quantity>
std::string html_of(const PlanOf<Quantity>& plan) {
  const Texts& texts = texts_of(plan);
  std::string figures, body = report::section("In short", paragraphs(further_sentences(plan)));
  if (!plan.grid.warnings.empty()) body += report::section("What to mind", paragraphs(plan.grid.warnings));
  for (const charts::Chart& chart : charts_of(plan))
    figures += report::figure(chart, "Of the " + texts.middle + ". " + dashed(plan.asked));
  body += report::section("Standard error over density", grid(figures) + texts.how);
  if (!plan.grid.needed.empty())
    body += report::section(
        report::capitalised(texts.beads) + " that are needed",
        report::html_of(needed_rows(plan),
                        {"plan_needed.csv", files::text_of(needed_table(Quantity{}), plan.grid.needed)}) +
            below_needed(plan));
  if (plan.drawn && !plan.drawn->numbers.empty())
    body += report::section("How well it held", grid(report::figure(drawn_chart(plan), texts.drawn_explained)));
  if (!plan.cells.empty())
    body += report::section("How many cells",
                            report::html_of(cell_listing(plan.cells)) +
                                report::note("plan.test", report::html_escaped(plan.cells.front().scatter.source)));
  body += report::section("All numbers", report::folded(counted(std::ssize(plan.grid.expected), "rows"),
                                                        report::html_of(expected_listing(plan))));
  return report::html_of(report::Page{.title = "Plan: " + plan.name, .what = answer_sentence(plan), .body = body});
}

template std::string svg_of(const Plan&);
template std::string svg_of(const SpacePlan&);
template std::string html_of(const Plan&);
template std::string html_of(const SpacePlan&);

}  // namespace mbtfm::plan
