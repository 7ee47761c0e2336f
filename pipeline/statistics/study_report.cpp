#include <fmt/format.h>

#include "pipeline/contract/version.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/page.h"
#include "pipeline/report/tension_plot.h"
#include "pipeline/statistics/study_files.h"

namespace mbtfm::statistics {
namespace {

using report::html_escaped;
using report::readable;
using report::Table;

std::string p_text(double p) { return p < 1e-4 ? fmt::format("{:.1e}", p) : readable(p); }

Table types_table(const Study& study, const StudyParameters& parameters) {
  Table table{{{"cell"},
               {"type"},
               {"cells", true},
               {"fibres", true},
               {"mean (nN)", true},
               {"median (nN)", true},
               {"SD (nN)", true},
               {"> " + readable(parameters.weak_tension_nN) + " nN (%)", true},
               {"> " + readable(parameters.strong_tension_nN) + " nN (%)", true}},
              {}};
  for (const TypeSummary& s : summarise_types(study, parameters)) {
    table.rows.push_back({s.cell.empty() ? "<b>all</b>" : html_escaped(s.cell), report::full_name_of(s.type),
                          std::to_string(s.n_cells), std::to_string(s.n_fibres), readable(s.mean_nN),
                          readable(s.median_nN), readable(s.sd_nN), readable(100 * s.fraction_above_weak),
                          readable(100 * s.fraction_above_strong)});
  }
  return table;
}

Table tests_table(const Study& study) {
  Table table{{{"test"},
               {"counted"},
               {"groups"},
               {"n"},
               {"statistic", true},
               {"p", true},
               {"p (Holm)", true},
               {"effect size", true}},
              {}};
  for (const TypeTest& t : test_types(study)) {
    const bool is_pair = !t.group_b.empty();
    table.rows.push_back({t.test, t.unit == Unit::fibre ? "fibres" : "medians of cells",
                          is_pair ? t.group_a + " against " + t.group_b : t.group_a,
                          is_pair ? fmt::format("{} and {}", t.n_a, t.n_b) : std::to_string(t.n_a),
                          readable(t.statistic), p_text(t.p_value), t.p_holm ? p_text(*t.p_holm) : "–",
                          readable(t.effect)});
  }
  return table;
}

Table cells_table(const Study& study) {
  Table table{{{"cell"},
               {"fibres", true},
               {"adhesions", true},
               {"total force (nN)", true},
               {"of fibres (nN)", true},
               {"of network (nN)", true},
               {"relative L2", true},
               {"expected", true},
               {"converged"}},
              {}};
  for (const StudyCell& c : study.cells) {
    table.rows.push_back({html_escaped(c.name), std::to_string(c.cell.fibres.size()),
                          std::to_string(c.cell.adhesions.size()), readable(c.fit.total_force_nN),
                          readable(c.fit.fibre_force_nN), readable(c.fit.network_force_nN), readable(c.fit.relative_l2),
                          readable(c.fit.expected_relative_l2), c.fit.converged ? "yes" : "<b>no</b>"});
  }
  return table;
}

std::string overview(const Study& study) {
  std::size_t n_fibres = 0, n_adhesions = 0, n_not_converged = 0;
  for (const StudyCell& c : study.cells) {
    n_fibres += c.cell.fibres.size();
    n_adhesions += c.cell.adhesions.size();
    n_not_converged += c.fit.converged ? 0 : 1;
  }
  const std::size_t n_measured = measured_fibres(study).size();
  std::string html = fmt::format(
      "<p>{} cells with {} adhesions and {} stress fibres; the tensions of {} of them could "
      "be identified and enter the statistics.</p>\n",
      study.cells.size(), n_adhesions, n_fibres, n_measured);
  if (n_not_converged > 0)
    html += fmt::format("<p><b>The fit of {} cells did not converge.</b></p>\n", n_not_converged);
  if (!study.unfinished.empty()) {
    html += fmt::format("<p>Without a fit and left out: {} cells", study.unfinished.size());
    for (std::size_t i = 0; i < study.unfinished.size(); ++i) {
      html += (i == 0 ? " (" : ", ") + html_escaped(study.unfinished[i]);
    }
    html += ").</p>\n";
  }
  return html;
}

}  // namespace

std::string study_html(const Study& study, const StudyParameters& parameters) {
  const std::string head = fmt::format("<h1>Stress-fibre tensions of {} cells</h1><p class=\"sub\">mbtfm {}</p>\n",
                                 study.cells.size(), kVersion);
  std::string body = report::section("In short", overview(study));
  body += report::section(
      "Tension by fibre type",
      "<div class=\"grid\">\n" +
          report::figure("Tension of each fibre", tensions_by_type_svg(study), "One dot a fibre; bar: median.") +
          report::figure("Total force of each cell", forces_by_cell_svg(study),
                         "Sum of the force magnitudes over adhesions, the strongest cell first.") +
          report::figure("Force and area of adhesions", adhesion_forces_svg(study),
                         "Filled: a segmented fibre ends on the adhesion.") +
          "</div>\n" + report::html_of(types_table(study, parameters), {"types.csv", types_csv(study, parameters)}));
  body += report::section(
      "Tests between types",
      report::html_of(tests_table(study), {"tests.csv", tests_csv(study)}) +
          "<p class=\"sub\">Two-sided. The fibres of a cell are not independent: tests that count fibres overstate the "
          "evidence; those that count one median a cell and type do not. Effect size: rank-biserial correlation for "
          "pairs (positive: the first group is stronger), epsilon squared for all. Holm’s correction is over the "
          "pairs. Types with fewer than two values are left out.</p>\n");
  body += report::section("Cells", report::html_of(cells_table(study), {"cells.csv", cells_csv(study)}));
  return report::page("Stress-fibre tensions – mbtfm", head, body);
}

}  // namespace mbtfm::statistics
