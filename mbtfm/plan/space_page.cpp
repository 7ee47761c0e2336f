#include "mbtfm/plan/space_page.h"

#include "mbtfm/plan/answer.h"
#include "mbtfm/plan/page_parts.h"
#include "mbtfm/plan/space_answer.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::plan {

namespace {

charts::Chart chart_of(const SpacePlan& plan, double noise_um) {
  std::vector<double> errors;
  for (const SpaceExpected& e : plan.grid.expected)
    if (e.quantity == SpaceQuantity::force) errors.push_back(e.standard_error_nN);
  return error_chart(
      plan.asked, noise_um, "beads per µm³", plan.asked.beads_per_um3, "middle patch", std::move(errors),
      [&](double E) {
        std::vector<ErrorDot> dots;
        for (const SpaceExpected& e : plan.grid.expected) {
          const SpacePoint& at = e.point;
          if (e.quantity == SpaceQuantity::force && at.youngs_modulus_kPa == E && at.noise_um == noise_um)
            dots.push_back({at.beads_per_um3, e.standard_error_nN, e.from_beads_nN});
        }
        return dots;
      });
}

std::vector<charts::Chart> charts_of(const SpacePlan& plan) {
  std::vector<charts::Chart> charts;
  for (const double noise_um : plan.asked.noise_um) charts.push_back(chart_of(plan, noise_um));
  return charts;
}

report::Table expected_rows(const SpacePlan& plan) {
  report::Table table{.columns = {number("gel (kPa)"), number("beads per µm³"), number("noise (µm)"), "quantity",
                                  number("number"), number("standard error (nN)"), number("by beads"),
                                  number("by background"), number("within target (%)"), number("map resolves (µm)"),
                                  number("two told from (µm)"), number("numbers told")}};
  for (const SpaceExpected& e : plan.grid.expected) {
    table.rows.push_back({brief(e.point.youngs_modulus_kPa), brief(e.point.beads_per_um3), brief(e.point.noise_um),
                          name_of(e.quantity), std::to_string(e.n), brief(e.standard_error_nN), brief(e.from_beads_nN),
                          brief(e.from_background_nN), brief(100 * e.share_within),
                          e.resolution_um ? brief(*e.resolution_um) : "–",
                          e.least_distance_um ? brief(*e.least_distance_um) : "–", brief(e.degrees)});
  }
  return table;
}

std::vector<DrawnDot> drawn_dots(const SpaceDrawn& drawn) {
  std::vector<DrawnDot> dots;
  for (const SpaceDrawnForce& f : drawn.forces)
    dots.push_back({f.true_nN, f.found_nN, f.predicted_error_nN, f.experiment,
                    "patch " + std::to_string(f.adhesion_id) + ", " + name_of(f.component)});
  return dots;
}

constexpr const char* kHow =
    "<p class=\"sub\">Standard errors are those that the reconstruction states, with lambda as data of this noise "
    "choose it. A modulus counts as noise does. More noise makes lambda larger, so that the error grows less than the "
    "noise. “By background” is the part by tractions beside the patches that the beads do not tell from them.</p>\n";

}  // namespace

std::string svg_of(const SpacePlan& plan) {
  return svg_of(charts_of(plan), plan.name + ": standard error of the middle patch's force.", plan.asked);
}

std::string html_of(const SpacePlan& plan) {
  const std::string head = head_of(plan.name, answer_sentence(plan), further_sentences(plan));
  std::string body;
  if (!plan.grid.warnings.empty()) body += report::section("What to mind", paragraphs(plan.grid.warnings));
  body += report::section("Standard error over density", figures_of(charts_of(plan), plan.asked) + kHow);
  const auto needed_text = [&](const SpaceNeeded& n) {
    return n.beads_per_um3 ? density_text(plan.asked.beads_per_um3, *n.beads_per_um3)
                           : "&gt; " + significant(most_beads_per_um3(plan.asked.beads_per_um3), 2);
  };
  body += report::section("Beads per µm³ that are needed",
                          report::html_of(needed_rows<SpaceNeeded>(plan.asked, plan.grid.needed, needed_text),
                                          {"plan_needed.csv", files::text_of(space_needed_table(), plan.grid.needed)}));
  if (plan.drawn)
    body +=
        report::section("How well it held",
                        report::figure(drawn_chart("component of a force", drawn_dots(*plan.drawn)),
                                       "Forces found in simulated experiments beside the true ones, by component."));
  body += report::section(
      "All numbers",
      report::html_of(expected_rows(plan), {"plan.csv", files::text_of(space_expected_table(), plan.grid.expected)}));
  return report::page("Plan – mbtfm", head, body);
}

}  // namespace mbtfm::plan
