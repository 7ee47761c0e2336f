#include "mbtfm/plan/space_page.h"

#include <algorithm>
#include <cmath>

#include "pipeline/charts/chart.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/version.h"
#include "pipeline/report/page.h"

namespace mbtfm::plan {

namespace {

std::string colour(std::size_t k) { return charts::kColours[k % std::size(charts::kColours)]; }

charts::Chart chart_of(const SpacePlan& plan, double noise_um) {
  std::vector<double> errors = {plan.asked.target_nN};
  for (const SpaceExpected& e : plan.grid.expected)
    if (e.quantity == SpaceQuantity::force) errors.push_back(e.standard_error_nN);
  charts::Chart chart("Noise " + brief(noise_um) + " µm",
                      charts::axis_over("beads per µm³", plan.asked.beads_per_um3, charts::Scale::logarithmic),
                      charts::axis_over("standard error of the middle patch (nN)", errors, charts::Scale::logarithmic));
  for (std::size_t k = 0; k < plan.asked.youngs_modulus_kPa.size(); ++k) {
    const double E = plan.asked.youngs_modulus_kPa[k];
    std::vector<Vec2> points;
    for (const SpaceExpected& e : plan.grid.expected) {
      if (e.quantity != SpaceQuantity::force || e.point.youngs_modulus_kPa != E || e.point.noise_um != noise_um)
        continue;
      points.push_back({e.point.beads_per_um3, e.standard_error_nN});
      chart.dot(points.back(), 3.5, "fill:" + colour(k) + ";stroke:#fff",
                brief(E) + " kPa, " + brief(e.point.beads_per_um3) + " beads per µm³: " + brief(e.standard_error_nN) +
                    " nN, of which " + brief(e.from_beads_nN) + " by the beads");
    }
    chart.curve(points, "fill:none;stroke-width:2;stroke:" + colour(k));
    chart.key(brief(E) + " kPa", colour(k));
  }
  chart.level(plan.asked.target_nN, "stroke:#333;stroke-width:1.5;stroke-dasharray:6 4");
  return chart;
}

std::vector<charts::Chart> charts_of(const SpacePlan& plan) {
  std::vector<charts::Chart> charts;
  for (const double noise_um : plan.asked.noise_um) charts.push_back(chart_of(plan, noise_um));
  return charts;
}

report::Table needed_rows(const SpacePlan& plan) {
  report::Table table{.columns = {{"gel (kPa)", true}}, .rows = {}};
  for (const double noise_um : plan.asked.noise_um) table.columns.push_back({"noise " + brief(noise_um) + " µm", true});
  for (const double E : plan.asked.youngs_modulus_kPa) {
    std::vector<std::string> row = {brief(E)};
    for (const SpaceNeeded& n : plan.grid.needed) {
      if (n.youngs_modulus_kPa == E)
        row.push_back(n.beads_per_um3 ? significant(*n.beads_per_um3, 2)
                                      : "&gt; " + significant(4 * plan.asked.beads_per_um3.back(), 2));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

report::Table expected_rows(const SpacePlan& plan) {
  report::Table table{.columns = {{"gel (kPa)", true},
                                  {"beads per µm³", true},
                                  {"noise (µm)", true},
                                  {"quantity"},
                                  {"number", true},
                                  {"standard error (nN)", true},
                                  {"by beads", true},
                                  {"by background", true},
                                  {"within target (%)", true},
                                  {"two apart from (µm)", true},
                                  {"numbers told", true}},
                      .rows = {}};
  for (const SpaceExpected& e : plan.grid.expected) {
    table.rows.push_back({brief(e.point.youngs_modulus_kPa), brief(e.point.beads_per_um3), brief(e.point.noise_um),
                          name_of(e.quantity), std::to_string(e.n), brief(e.standard_error_nN), brief(e.from_beads_nN),
                          brief(e.from_background_nN), brief(100 * e.share_within),
                          e.resolution_um ? brief(*e.resolution_um) : "–", brief(e.degrees)});
  }
  return table;
}

charts::Chart drawn_chart(const SpaceDrawn& drawn) {
  std::vector<double> both;
  for (const SpaceDrawnForce& f : drawn.forces) both.insert(both.end(), {f.true_nN, f.found_nN});
  charts::Chart chart("Drawn experiments",
                      charts::axis_over("true component of a force (nN)", both, charts::Scale::linear),
                      charts::axis_over("found, ± predicted standard error (nN)", both, charts::Scale::linear));
  const auto [least, most] = std::ranges::minmax(both);
  chart.curve({{least, least}, {most, most}}, "fill:none;stroke:#999;stroke-width:1");
  for (const SpaceDrawnForce& f : drawn.forces) {
    const std::string of = colour(static_cast<std::size_t>(f.experiment));
    chart.error({f.true_nN, f.found_nN - f.predicted_error_nN}, {f.true_nN, f.found_nN + f.predicted_error_nN},
                "stroke-width:1;stroke:" + of);
    chart.dot({f.true_nN, f.found_nN}, 3, "fill:" + of + ";stroke:#fff",
              "patch " + std::to_string(f.adhesion_id) + ", " + name_of(f.component) + ": true " + brief(f.true_nN) +
                  " nN, found " + brief(f.found_nN) + " ± " + brief(f.predicted_error_nN) + " nN");
  }
  return chart;
}

std::string paragraphs(const std::vector<std::string>& texts) {
  std::string html;
  for (const std::string& text : texts) html += "<p>" + report::html_escaped(text) + "</p>\n";
  return html;
}

constexpr const char* kHow =
    "<p class=\"sub\">Standard errors are those that the reconstruction states, with lambda as data of this noise "
    "choose "
    "it. A modulus counts as noise does. More noise makes lambda larger, so that the error grows less than the noise. "
    "“By background” is the part by tractions beside the patches that the beads do not tell from them.</p>\n";

std::string dashed(const SpacePlan& plan) { return "Dashed: the target of " + brief(plan.asked.target_nN) + " nN."; }

}  // namespace

std::string svg_of(const SpacePlan& plan) {
  const std::vector<charts::Chart> charts = charts_of(plan);
  return charts::svg_file(charts, std::min<int>(2, static_cast<int>(charts.size())),
                          {plan.name + ": standard error of the middle patch's force.", dashed(plan)});
}

std::string html_of(const SpacePlan& plan) {
  const std::string head = "<h1>Plan: " + report::html_escaped(plan.name) + "</h1><p class=\"sub\">mbtfm " +
                           std::string(kVersion) + "</p>\n<p><b>" + report::html_escaped(answer_sentence(plan)) +
                           "</b></p>\n" + paragraphs(further_sentences(plan));
  std::string body, curves;
  if (!plan.grid.warnings.empty()) body += report::section("What to mind", paragraphs(plan.grid.warnings));
  for (const charts::Chart& chart : charts_of(plan)) curves += report::figure(chart, dashed(plan));
  body += report::section("Standard error over density", curves + kHow);
  body += report::section(
      "Beads per µm³ that are needed",
      report::html_of(needed_rows(plan), {"plan_needed.csv", files::text_of(space_needed_table(), plan.grid.needed)}));
  if (plan.drawn)
    body +=
        report::section("How well it held",
                        report::figure(drawn_chart(*plan.drawn),
                                       "Forces found in simulated experiments beside the true ones, by component."));
  body += report::section(
      "All numbers",
      report::html_of(expected_rows(plan), {"plan.csv", files::text_of(space_expected_table(), plan.grid.expected)}));
  return report::page("Plan – mbtfm", head, body);
}

}  // namespace mbtfm::plan
