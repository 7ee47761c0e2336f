#include "mbtfm/sheet_stage/runs.h"

#include <algorithm>

#include "continuum/sheet/picture.h"
#include "continuum/sheet/recovery.h"
#include "continuum/sheet/tables.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/charts/chart.h"
#include "pipeline/files/text.h"

namespace mbtfm::sheet_stage {

std::size_t write_solution(stage::StageContext& context, const Solution& solution) {
  const std::vector<SheetPoint> rows = context.has_input("points")
                                           ? at_points_of(solution, files::read_points(context.input("points")))
                                           : at_nodes_of(solution);
  write_sheet(context.output("out", "sheet.csv"), rows);
  tractions::write_tractions(context.output("out", "traction.csv"), solution.patches);
  write_sheet_vtu(context.output("out", "sheet.vtu"), solution);
  files::write_text(context.output("out", "sheet.svg"), picture_of(solution, "mbtfm-sheet; x to the right, y down"));
  return static_cast<std::size_t>(std::ranges::count_if(rows, [](const SheetPoint& row) { return !row.ux_um; }));
}

Figures write_cells(stage::StageContext& context, const Solution& solution, const std::optional<double>& pixel_um) {
  if (!context.has_input("cells")) return {};
  constexpr double kShortest_um = 2;
  const CellLabels labels = read_labels(context.input("cells"), pixel_um);
  const std::vector<Border> borders = borders_of(labels, solution, kShortest_um);
  write_borders(context.output("out", "borders.csv"), borders);
  write_cell_tensions(context.output("out", "cell_tension.csv"), cell_tensions(labels, solution));
  double length = 0, normal = 0, shear = 0, magnitude = 0;
  for (const Border& b : borders) {
    length += b.length_um;
    normal += b.length_um * b.normal_nN_per_um;
    shear += b.length_um * b.shear_nN_per_um;
    magnitude += b.length_um * b.magnitude_nN_per_um;
  }
  if (length == 0) return {};
  return {{"n_borders", static_cast<std::int64_t>(borders.size())},
          {"border_normal_nN_per_um", normal / length},
          {"border_shear_nN_per_um", shear / length},
          {"border_magnitude_nN_per_um", magnitude / length}};
}

Figures figures_of(const Solution& solution, const Balance& balance) {
  double largest_um = 0;
  for (int i = 0; i < solution.elements->n_nodes(); ++i)
    largest_um = std::max(largest_um, norm(at_node(solution.u, i)));
  double largest_kPa = 0;
  for (const GroundPatch& patch : solution.patches) largest_kPa = std::max(largest_kPa, norm(patch.traction_kPa));
  Figures figures = {{"n_triangles", std::int64_t{solution.elements->n_triangles()}},
                     {"n_nodes", std::int64_t{solution.elements->n_nodes()}},
                     {"area_um2", balance.area_um2},
                     {"mean_tension_nN_per_um", balance.mean_tension_nN_per_um},
                     {"virial_tension_nN_per_um", balance.virial_tension_nN_per_um},
                     {"largest_displacement_um", largest_um},
                     {"largest_traction_kPa", largest_kPa},
                     {"total_force_nN", balance.total_force_nN},
                     {"net_force_nN", norm(balance.net_force_nN)},
                     {"net_torque_nN_um", balance.net_torque_nN_um},
                     {"energy_fJ", balance.elastic_energy_fJ},
                     {"mesh_relative_error", relative_error(*solution.elements, solution.at_points, solution.at_nodes)},
                     {"iterations", std::int64_t{solution.report.iterations}}};
  if (solution.gel_held) figures.emplace_back("strain_energy_fJ", balance.ground_energy_fJ);
  return figures;
}

void write_page(stage::StageContext& context, const Run& done, const Balance& balance) {
  report::StagePage page{
      .title = "Contracting sheet", .facts = {}, .findings = context.findings_, .tables = {}, .figures = done.figures};
  constexpr double kRounding = 1e-6;
  if (!done.fitted.empty()) page.facts.push_back("Fitted to the beads: " + done.fitted + ".");
  if (!done.varied.empty()) page.facts.push_back(done.varied);
  page.facts.push_back("The mean tension is " + charts::readable(balance.mean_tension_nN_per_um) + " nN/µm over " +
                       charts::readable(balance.area_um2) + " µm²; the forces on the ground add up to " +
                       charts::readable(balance.total_force_nN) + " nN in size, " +
                       (norm(balance.net_force_nN) > kRounding * balance.total_force_nN
                            ? "and to a net force of " + charts::readable(norm(balance.net_force_nN)) + " nN."
                            : std::string("and balance each other.")));
  page.picture_svg = picture_of(done.solution, "x to the right, y down");
  page.picture_title = "Tension and traction";
  page.picture_explained =
      "Left: mean principal tension. Right: traction on the ground; arrows are means over squares.";
  page.tables = done.tables;
  files::write_text(context.output("out", "sheet.html"), report::html_of(page));
}

}  // namespace mbtfm::sheet_stage
