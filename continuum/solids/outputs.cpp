#include "continuum/solids/outputs.h"

#include <algorithm>

#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/report.h"
#include "pipeline/files/columns.h"
#include "pipeline/files/vtk_files.h"

namespace mbtfm::solids {
namespace {

using files::kResult;
using files::member;

/// None of a case without an equilibrium.
const Indentation* solved(const Indentation& i) { return i.failure ? nullptr : &i; }

files::Table<Indentation> table_of_cases(const std::vector<double>& depths_um) {
  using Row = Indentation;
  files::Table<Row> table{.file = "indent.csv",
                          .columns = {{"height_um", member(&Row::of, &Case::height_um)},
                                      {"modulus_ratio", member(&Row::of, &Case::modulus_ratio)}}};
  const auto reading = [](auto number) { return member(solved, &Row::reading, number); };
  for (std::size_t k = 0; k < depths_um.size(); ++k) {
    const std::string depth = shortest(depths_um[k]);
    table.columns.push_back(
        {"depth_" + depth + "_um",
         [k](const Row& row) { return solved(row) ? std::optional(row.reading.depth_um[k]) : std::nullopt; }, kResult});
  }
  table.columns.push_back({{"largest_u_um", reading(&Reading::largest_u_um), kResult},
                           {"error_um", member(solved, &Row::error_um), kResult},
                           {"contact_radius_um", &Row::contact_radius_um, kResult},
                           {"contact_area_um2", &Row::contact_area_um2, kResult},
                           {"lift_um", reading(&Reading::lift_um), kResult},
                           {"largest_u_gel_um", reading(&Reading::largest_u_gel_um), kResult},
                           {"top_down_um", reading(&Reading::top_down_um), kResult},
                           {"not_solved", [](const Row& row) { return row.failure.value_or(""); }}});
  return table;
}

files::Table<Optimum> table_of_optima() {
  return {.file = "optima.csv",
          .columns = {{"modulus_ratio", &Optimum::modulus_ratio},
                      {"read_at_um", &Optimum::read_at_um},
                      {"height_um", &Optimum::height_um, kResult},
                      {"height_error_um", &Optimum::height_error_um, kResult},
                      {"depth_um", &Optimum::depth_um, kResult},
                      {"contact_area_um2", &Optimum::contact_area_um2, kResult}}};
}

}  // namespace

void write_indentations(const Path& file, const std::vector<Indentation>& solved,
                        const std::vector<double>& depths_um) {
  files::write(file, table_of_cases(depths_um), solved);
}

void write_optima(const Path& file, const std::vector<Optimum>& optima) {
  files::write(file, table_of_optima(), optima);
}

void write_deformed_vtu(const Path& file, const Deformed& deformed) {
  const Mesh& mesh = *deformed.body.mesh;
  files::Grid grid{.points_um = {}, .cells = {}, .point_arrays = {}, .cell_arrays = {}};
  const auto in_space = [](Vec2 v) { return Vec3{v.x, 0, v.y}; };
  for (const Vec2 at : mesh.position_um) grid.points_um.push_back(in_space(at));
  grid.point_arrays = {files::array_of("displacement_um", deformed.displacement_um, in_space)};
  grid.cell_arrays = {{"part", 1, {}}, {"stress_kPa", 4, {}}};
  const int order = mesh.square.order();
  const std::vector<double>& nodes = mesh.square.nodes();
  for (int e = 0; e < mesh.n_elements(); ++e) {
    for (int j = 0; j < order; ++j) {
      for (int i = 0; i < order; ++i) {
        for (const int k :
             {j * (order + 1) + i, j * (order + 1) + i + 1, (j + 1) * (order + 1) + i + 1, (j + 1) * (order + 1) + i})
          grid.cells.push_back(mesh.nodes_of(e)[k]);
        grid.cell_arrays[0].values.push_back(mesh.part[e]);
        const Eigen::Vector4d stress =
            deformed.stress_kPa_at({e, {0.5 * (nodes[i] + nodes[i + 1]), 0.5 * (nodes[j] + nodes[j + 1])}});
        for (const double value : stress) grid.cell_arrays[1].values.push_back(value);
      }
    }
  }
  files::write_grid_vtu(file, grid);
}

void write_deformed_vtu(const Path& file, const RevolvedBody& deformed) {
  const RevolvedMesh& mesh = deformed.mesh;
  files::Grid grid{.corners = 8, .points_um = mesh.position_um, .cells = {}, .point_arrays = {}, .cell_arrays = {}};
  grid.point_arrays = {files::array_of("displacement_um", deformed.displacement_um)};
  grid.cell_arrays = {{"part", 1, {}}, files::array_of("stress_kPa", deformed.stress_kPa())};
  const int order = mesh.half_plane.mesh->square.order(), row = order + 1;
  for (int e = 0; e < mesh.n_elements(); ++e) {
    for (int first = 0; first < order * row * row; ++first) {
      if (first % row == order || first / row % row == order) continue;  // the last node of a side begins nothing
      // (u, v, angle) turn the other way round than (x, y, z): the face further on comes first
      for (const int face : {first + row * row, first})
        for (const int corner : {face, face + 1, face + row + 1, face + row})
          grid.cells.push_back(mesh.nodes_of(e)[corner]);
      grid.cell_arrays[0].values.push_back(mesh.part[e]);
    }
  }
  files::write_grid_vtu(file, grid);
}

std::string pages_of_tables() { return files::page_of(table_of_cases({0, 5})) + files::page_of(table_of_optima()); }

namespace {

Figures figures_of(const Setting& setting, const std::vector<Indentation>& solved) {
  double error = 0, imbalance = 0;
  int iterations = 0;
  std::int64_t n_failed = 0;
  for (const Indentation& one : solved) {
    if (one.failure) {
      ++n_failed;
      continue;
    }
    error = std::max(error, one.error_um / one.reading.largest_u_um);
    imbalance = std::max(imbalance, one.imbalance);
    iterations = std::max(iterations, one.iterations);
  }
  Figures figures = {{"n_cases", static_cast<std::int64_t>(solved.size())},
                     {"strain", std::string(name_of(setting.strain))},
                     {"free_contraction", setting.cell.free_contraction()},
                     {"sphere_height_um", sphere_height_um(setting.volume_um3)},
                     {"hemisphere_height_um", hemisphere_height_um(setting.volume_um3)},
                     {"largest_relative_error", error},
                     {"net_force_over_sum", imbalance},
                     {"newton_iterations", std::int64_t{iterations}}};
  if (n_failed > 0) figures.emplace_back("n_cases_without_equilibrium", n_failed);
  if (solved.size() > 1) return figures;
  const Indentation& one = solved.front();
  for (std::size_t k = 0; k < setting.depths_um.size(); ++k)
    figures.emplace_back("depth_" + shortest(setting.depths_um[k]) + "_um", one.reading.depth_um[k]);
  figures.emplace_back("lift_um", one.reading.lift_um);
  figures.emplace_back("largest_u_um", one.reading.largest_u_um);
  figures.emplace_back("error_um", one.error_um);
  figures.emplace_back("energy_fJ", one.energy_fJ);
  return figures;
}

std::string summary_of(const Setting& setting, const std::vector<Indentation>& solved, std::ptrdiff_t n_optima) {
  if (solved.size() == 1) {
    const Reading& r = solved.front().reading;
    return "presses " + brief(r.depth_um.back()) + " um deep (" + brief(setting.depths_um.back()) +
           " um below the surface), moves by " + brief(r.largest_u_um) + " um at most; error " +
           brief(solved.front().error_um) + " um";
  }
  const auto n_failed = std::ranges::count_if(solved, [](const Indentation& i) { return i.failure.has_value(); });
  return counted(std::ssize(solved), "cases") + ", " +
         (n_failed > 0 ? std::to_string(n_failed) + " of them without an equilibrium, " : std::string()) +
         counted(n_optima, "best heights");
}

}  // namespace

void notice_failures(stage::StageContext& context, const std::vector<Indentation>& solved) {
  std::vector<const Indentation*> failed;
  for (const Indentation& one : solved)
    if (one.failure) failed.push_back(&one);
  if (failed.empty()) return;
  const Indentation& first = *failed.front();
  if (failed.size() == solved.size()) {
    throw NotSolved({.reason = solved.size() == 1 ? *first.failure
                                                  : "none of " + std::to_string(solved.size()) +
                                                        " cases has an equilibrium; the first: " + *first.failure});
  }
  context.notice(noticed(Symptom::cases_not_solved, static_cast<double>(failed.size()),
                         {.value = std::to_string(failed.size()) + " of " + std::to_string(solved.size()),
                          .at = "first: height " + brief(first.of.height_um) + " um, modulus ratio " +
                                brief(first.of.modulus_ratio) + ": " + *first.failure}));
}

StageReport report_of(const Setting& setting, const std::vector<Indentation>& solved, std::ptrdiff_t n_optima,
                      stage::StageContext& context) {
  StageReport report;
  report.converged = std::ranges::none_of(solved, [](const Indentation& i) { return i.failure.has_value(); });
  report.figures = figures_of(setting, solved);
  report.summary = summary_of(setting, solved, n_optima);
  if (setting.strain != Strain::large)
    context.notice(noticed(Symptom::contraction_beyond_linear, setting.cell.free_contraction()));
  return report;
}

}  // namespace mbtfm::solids
