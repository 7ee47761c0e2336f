#include "substrate/block_mesh.h"

#include <deal.II/base/multithread_info.h>
#include <deal.II/dofs/dof_handler.h>
#include <deal.II/dofs/dof_tools.h>
#include <deal.II/fe/fe_q.h>
#include <deal.II/fe/fe_tools.h>
#include <deal.II/fe/mapping_cartesian.h>
#include <deal.II/grid/grid_generator.h>
#include <deal.II/grid/tria.h>
#include <deal.II/lac/affine_constraints.h>

#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"

namespace mbtfm::substrate {

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
    if (triangulation.n_active_cells() > most_cells) {
      throw NotSolved(
          Report{.reason = "the substrate's mesh has more than " + std::to_string(most_cells) +
                           " elements; one of at most half as many would fit the memory allowed: "
                           "ask for a coarser one (displacement_tolerance, elements_across_adhesion), allow more "
                           "(memory_limit_GB), or take the model 'layer'"});
    }
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

/// Index of the interval of `line` that holds x; the last one holds its upper end.
int interval_of(const std::vector<double>& line, double x) {
  const auto above = std::upper_bound(line.begin() + 1, line.end() - 1, x);
  return static_cast<int>(above - line.begin()) - 1;
}

/// Level, and position among the level's cells across the block.
std::uint64_t surface_key(const GridLines& lines, int level, Vec2 point) {
  const auto index = [level](const std::vector<double>& line, double x) {
    const int coarse = interval_of(line, x);
    const double fraction = (x - line[coarse]) / (line[coarse + 1] - line[coarse]);
    const std::uint64_t n = std::uint64_t{1} << level;
    const auto fine = static_cast<std::uint64_t>(std::max(0.0, fraction * static_cast<double>(n)));
    return coarse * n + std::min(fine, n - 1);
  };
  return static_cast<std::uint64_t>(level) << 58 | index(lines.x_um, point.x) << 29 | index(lines.y_um, point.y);
}

constexpr int kMostLevels = 20;  // of halving: the key has 29 bits for a position

}  // namespace

BlockMesh make_block_mesh(const GridLines& lines, int order, const std::function<bool(const Box&)>& is_too_large,
                          std::int64_t most_cells, int threads) {
  dealii::MultithreadInfo::set_thread_limit(threads);
  dealii::Triangulation<3> triangulation;
  dealii::GridGenerator::subdivided_hyper_rectangle(triangulation,
                                                    {steps(lines.x_um), steps(lines.y_um), steps(lines.z_um)},
                                                    corner(lines, true), corner(lines, false));
  refine(triangulation, is_too_large, most_cells);
  MBTFM_ASSERT(static_cast<int>(triangulation.n_levels()) <= kMostLevels);
  const dealii::FE_Q<3> element(order);
  dealii::DoFHandler<3> handler(triangulation);
  handler.distribute_dofs(element);

  BlockMesh mesh;
  mesh.order = order;
  mesh.lines = lines;
  mesh.position_um.resize(handler.n_dofs());
  mesh.hanging = hanging_nodes(handler);
  mesh.cells.reserve(triangulation.n_active_cells());
  const auto order_of = dealii::FETools::lexicographic_to_hierarchic_numbering<3>(order);
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
    if (cell->face(4)->at_boundary()) {
      const Vec2 centre = {box.low_um[0] + 0.5 * box.size_um[0], box.low_um[1] + 0.5 * box.size_um[1]};
      mesh.cell_at_surface[surface_key(lines, cell->level(), centre)] = static_cast<int>(mesh.cells.size());
    }
    mesh.cells.push_back(box);
  }
  return mesh;
}

int surface_cell(const BlockMesh& mesh, Vec2 point_um) {
  const auto is_within = [](const std::vector<double>& line, double x) {
    return x >= line.front() && x <= line.back();
  };
  if (!is_within(mesh.lines.x_um, point_um.x) || !is_within(mesh.lines.y_um, point_um.y)) return -1;
  for (int level = 0; level < kMostLevels; ++level) {
    const auto found = mesh.cell_at_surface.find(surface_key(mesh.lines, level, point_um));
    if (found != mesh.cell_at_surface.end()) return found->second;
  }
  throw InternalError("no cell of the surface holds a point of the block");
}

std::array<double, 3> shape_values(int order, double t) {
  if (order == 1) return {1 - t, t, 0};
  return {(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)};
}

std::array<double, 3> shape_slopes(int order, double t) {
  if (order == 1) return {-1, 1, 0};
  return {4 * t - 3, 4 - 8 * t, 4 * t - 1};
}

}  // namespace mbtfm::substrate
