/// What of a block mesh deal.II makes. A library of its own, loaded when a mesh is wanted: see load_mesh_maker.
#include <deal.II/base/multithread_info.h>
#include <deal.II/dofs/dof_handler.h>
#include <deal.II/dofs/dof_tools.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/fe/fe_tools.h>
#include <deal.II/fe/mapping_cartesian.h>
#include <deal.II/grid/grid_generator.h>
#include <deal.II/grid/tria.h>
#include <deal.II/lac/affine_constraints.h>

#include <stdexcept>

#include "substrate/elements/mesh_maker.h"

namespace mbtfm::elements {

namespace {

Box box_of(const dealii::Triangulation<3>::cell_iterator& cell) {
  Box box;
  for (int axis = 0; axis < 3; ++axis) {
    box.low_um[axis] = cell->vertex(0)[axis];
    box.size_um[axis] = cell->vertex(7)[axis] - cell->vertex(0)[axis];
  }
  return box;
}

dealii::Point<3> corner(const GridLines& lines, bool is_first) {
  const auto end = [&](const std::vector<double>& line) { return is_first ? line.front() : line.back(); };
  return {end(lines.x_um), end(lines.y_um), end(lines.z_um)};
}

std::vector<double> steps(const std::vector<double>& line) {
  std::vector<double> result;
  for (std::size_t i = 1; i < line.size(); ++i) result.push_back(line[i] - line[i - 1]);
  return result;
}

void refine(dealii::Triangulation<3>& triangulation, const std::function<bool(const Box&)>& is_too_large,
            std::int64_t most_cells) {
  for (int level = 0; level < static_cast<int>(triangulation.n_levels()); ++level) {
    // cells of coarser levels that are still whole have been found small enough before
    bool is_done = true;
    for (const auto& cell : triangulation.active_cell_iterators_on_level(level)) {
      if (!is_too_large(box_of(cell))) continue;
      cell->set_refine_flag();
      is_done = false;
    }
    if (is_done) break;
    triangulation.execute_coarsening_and_refinement();
    if (triangulation.n_active_cells() > most_cells) throw std::length_error("too many elements");
  }
}

std::vector<std::vector<NodeWeight>> hanging_nodes(const dealii::DoFHandler<3>& handler) {
  dealii::AffineConstraints<double> constraints;
  dealii::DoFTools::make_hanging_node_constraints(handler, constraints);
  constraints.close();
  std::vector<std::vector<NodeWeight>> hanging(handler.n_dofs());
  for (const auto& line : constraints.get_lines()) {
    for (const auto& [node, weight] : line.entries) hanging[line.index].push_back({static_cast<int>(node), weight});
  }
  return hanging;
}

}  // namespace

extern "C" void mbtfm_make_mesh(BlockMesh& mesh, const std::function<bool(const Box&)>& is_too_large,
                                std::int64_t most_cells, int threads) {
  const GridLines& lines = mesh.lines;
  dealii::MultithreadInfo::set_thread_limit(threads);
  dealii::Triangulation<3> triangulation;
  dealii::GridGenerator::subdivided_hyper_rectangle(triangulation,
                                                    {steps(lines.x_um), steps(lines.y_um), steps(lines.z_um)},
                                                    corner(lines, true), corner(lines, false));
  refine(triangulation, is_too_large, most_cells);
  const dealii::FE_Q<3> element(2);
  dealii::DoFHandler<3> handler(triangulation);
  handler.distribute_dofs(element);

  mesh.position_um.resize(handler.n_dofs());
  mesh.hanging = hanging_nodes(handler);
  mesh.cells.reserve(triangulation.n_active_cells());
  const auto order_of = dealii::FETools::lexicographic_to_hierarchic_numbering<3>(2);
  std::vector<dealii::types::global_dof_index> nodes(element.n_dofs_per_cell());
  for (const auto& cell : handler.active_cell_iterators()) {
    const Box box = box_of(cell);
    cell->get_dof_indices(nodes);
    for (unsigned k = 0; k < nodes.size(); ++k) {
      const int node = static_cast<int>(nodes[order_of[k]]);
      const dealii::Point<3> unit = element.unit_support_point(order_of[k]);
      mesh.cell_nodes.push_back(node);
      for (int axis = 0; axis < 3; ++axis) {
        mesh.position_um[node][axis] = box.low_um[axis] + unit[axis] * box.size_um[axis];
      }
    }
    mesh.cells.push_back(box);
    mesh.cell_levels.push_back(cell->level());
  }
}

}  // namespace mbtfm::elements
