#include "mbtfm/plan/page.h"

#include <cmath>

#include "mbtfm/plan/answer.h"
#include "mbtfm/plan/page_parts.h"
#include "mbtfm/plan/tables.h"

namespace mbtfm::plan {
namespace {

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

template <class Quantity>
charts::Chart chart_of(const PlanOf<Quantity>& plan, double noise_um) {
  const Quantity quantity = drawn_quantity(plan);
  const Texts& texts = texts_of(plan);
  std::vector<double> errors;
  for (const auto& e : plan.grid.expected)
    if (e.quantity == quantity) errors.push_back(e.standard_error_nN);
  return error_chart(plan.asked, noise_um, texts.beads, plan.asked.densities, texts.middle, std::move(errors),
                     [&](double E) {
                       std::vector<ErrorDot> dots;
                       for (const auto& e : plan.grid.expected)
                         if (e.quantity == quantity && e.point.youngs_modulus_kPa == E && e.point.noise_um == noise_um)
                           dots.push_back({e.point.density, e.standard_error_nN, e.from_beads_nN, further_of(e)});
                       return dots;
                     });
}

template <class Quantity>
std::vector<charts::Chart> charts_of(const PlanOf<Quantity>& plan) {
  std::vector<charts::Chart> charts;
  for (const double noise_um : plan.asked.noise_um) charts.push_back(chart_of(plan, noise_um));
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

template <class Quantity>
charts::Chart drawn_chart(const PlanOf<Quantity>& plan) {
  std::vector<DrawnDot> dots;
  for (const DrawnNumber& d : plan.drawn->numbers)
    dots.push_back({d.true_nN, d.found_nN, d.predicted_error_nN, d.experiment, name_of_number(plan, d)});
  return drawn_chart(texts_of(plan).drawn, dots);
}

}  // namespace

template <class Quantity>
std::string svg_of(const PlanOf<Quantity>& plan) {
  const Texts& texts = texts_of(plan);
  return svg_of(charts_of(plan), plan.name + ": standard error of the " + texts.middle + "'s " + texts.of_middle + ".",
                plan.asked);
}

template <class Quantity>
std::string html_of(const PlanOf<Quantity>& plan) {
  const Texts& texts = texts_of(plan);
  const std::string head = head_of(plan.name, answer_sentence(plan), further_sentences(plan));
  std::string body;
  if (!plan.grid.warnings.empty()) body += report::section("What to mind", paragraphs(plan.grid.warnings));
  body += report::section("Standard error over density", figures_of(charts_of(plan), plan.asked) + texts.how);
  if (!plan.grid.needed.empty())
    body += report::section(
        report::capitalised(texts.beads) + " that are needed",
        report::html_of(
            needed_rows(plan.asked, plan.grid.needed, [&](const Needed& n) { return needed_text(plan, n); }),
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
