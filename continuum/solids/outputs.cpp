#include "continuum/solids/outputs.h"

#include "pipeline/contract/numbers.h"
#include "pipeline/files/columns.h"
#include "pipeline/files/vtk_files.h"

namespace mbtfm::solids {
namespace {

using files::kForPeople;

files::Table<Indentation> table_of_cases(const std::vector<double>& depths_um) {
  files::Table<Indentation> table{
      .file = "indent.csv",
      .row = "each cell on each gel",
      .columns = {{"height_um", "height of the cell", [](const Indentation& i) { return i.of.height_um; }},
                  {"modulus_ratio", "Young's modulus of the gel over the cell's",
                   [](const Indentation& i) { return i.of.modulus_ratio; }}}};
  // of a case without an equilibrium the fields are empty
  const auto add = [&](const std::string& name, const std::string& meaning, auto get) {
    table.columns.push_back({name,
                             meaning,
                             [get](const Indentation& i) -> std::optional<double> {
                               if (i.failure) return std::nullopt;
                               return get(i);
                             },
                             {.digits = kForPeople}});
  };
  for (std::size_t k = 0; k < depths_um.size(); ++k) {
    add("depth_" + shortest(depths_um[k]) + "_um",
        "largest displacement into the gel, " + shortest(depths_um[k]) + " um below its surface",
        [k](const Indentation& i) { return i.reading.depth_um[k]; });
  }
  add("largest_u_um", "largest displacement anywhere", [](const Indentation& i) { return i.reading.largest_u_um; });
  add("error_um", "largest change of the depths and displacements of the row on a coarser mesh",
      [](const Indentation& i) { return i.error_um; });
  table.columns.push_back({"contact_radius_um",
                           "radius of the contact, or of the circle of its area",
                           &Indentation::contact_radius_um,
                           {.digits = kForPeople}});
  table.columns.push_back(
      {"contact_area_um2", "area of the contact", &Indentation::contact_area_um2, {.digits = kForPeople}});
  add("lift_um", "largest displacement of the gel's surface out of it, near the rim of the contact",
      [](const Indentation& i) { return i.reading.lift_um; });
  add("largest_u_gel_um", "largest displacement in the gel",
      [](const Indentation& i) { return i.reading.largest_u_gel_um; });
  add("top_down_um", "displacement of the cell's top towards the gel",
      [](const Indentation& i) { return i.reading.top_down_um; });
  table.columns.push_back({"not_solved", "why the case has no equilibrium; empty: it has one",
                           [](const Indentation& i) { return i.failure.value_or(""); }});
  return table;
}

const files::Table<Optimum>& table_of_optima() {
  static const files::Table<Optimum> table{
      .file = "optima.csv",
      .row = "the best height on each gel, for each depth of reading",
      .columns = {
          {"modulus_ratio", "Young's modulus of the gel over the cell's", &Optimum::modulus_ratio},
          {"read_at_um", "depth of reading below the surface", &Optimum::read_at_um},
          {"height_um", "height of the cell that presses deepest", &Optimum::height_um, {.digits = kForPeople}},
          {"height_error_um",
           "by which the meshes and the search may be off",
           &Optimum::height_error_um,
           {.digits = kForPeople}},
          {"depth_um", "displacement into the gel there", &Optimum::depth_um, {.digits = kForPeople}},
          {"contact_area_um2", "area of the contact there", &Optimum::contact_area_um2, {.digits = kForPeople}}}};
  return table;
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
  grid.point_arrays = {{"displacement_um", 3, {}}};
  for (std::size_t k = 0; k < mesh.position_um.size(); ++k) {
    grid.points_um.push_back({mesh.position_um[k].x, 0, mesh.position_um[k].y});
    const Vec2 u = deformed.displacement_um[k];
    for (const double value : {u.x, 0.0, u.y}) grid.point_arrays[0].values.push_back(value);
  }
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
  files::Grid grid{.corners = 8, .points_um = {}, .cells = {}, .point_arrays = {}, .cell_arrays = {}};
  grid.point_arrays = {{"displacement_um", 3, {}}};
  for (std::size_t k = 0; k < mesh.position_um.size(); ++k) {
    const Vec3 at = mesh.position_um[k], u = deformed.displacement_um[k];
    grid.points_um.push_back({at.x, at.y, at.z});
    for (const double value : {u.x, u.y, u.z}) grid.point_arrays[0].values.push_back(value);
  }
  grid.cell_arrays = {{"part", 1, {}}, {"stress_kPa", 6, {}}};
  for (const auto& stress : deformed.stress_kPa())
    grid.cell_arrays[1].values.insert(grid.cell_arrays[1].values.end(), stress.begin(), stress.end());
  const int order = mesh.half_plane.mesh->square.order(), row = order + 1;
  for (int e = 0; e < mesh.n_elements(); ++e) {
    for (int first = 0; first < order * row * row; ++first) {
      if (first % row == order || first / row % row == order) continue;  // the last node of a side begins nothing
      // (u, v, angle) turn the other way round than (x, y, z): the face further on comes first
      for (const int face : {first + row * row, first}) {
        for (const int corner : {face, face + 1, face + row + 1, face + row})
          grid.cells.push_back(mesh.nodes_of(e)[corner]);
      }
      grid.cell_arrays[0].values.push_back(mesh.part[e]);
    }
  }
  files::write_grid_vtu(file, grid);
}

std::string pages_of_tables() { return files::page_of(table_of_cases({0, 5})) + files::page_of(table_of_optima()); }

}  // namespace mbtfm::solids
