/// Hexahedral meshes of a rectangular block, locally refined: made by deal.II, given as plain arrays.
#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm::elements {

/// An axis-parallel box.
struct Box {
  std::array<double, 3> low_um{}, size_um{};
};

/// Lines of the coarsest grid along each axis, rising; z_um starts at 0, the surface.
struct GridLines {
  std::vector<double> x_um, y_um, z_um;
};

constexpr int kMostLevels = 20;  ///< of halving

/// Of a box: its level of halving, and its place among the boxes of that level.
using BoxKey = std::array<std::uint32_t, 4>;

/// Evenly from low - margin to high + margin, so many that no step is longer than `step_um`.
std::vector<double> even_lines(double low, double high, double margin_um, double step_um);

struct NodeWeight {
  int node = 0;
  double weight = 0;
};

/// Nodes of continuous quadratic elements.
struct BlockMesh {
  GridLines lines;
  std::vector<Box> cells;
  std::vector<int> cell_levels;                    ///< by cell: how often one of the grid was halved
  std::vector<int> cell_nodes;                     ///< 27 a cell, x fastest, then y, then z
  std::vector<std::array<double, 3>> position_um;  ///< by node
  std::vector<std::vector<NodeWeight>> hanging;    ///< by node: what it hangs on; empty: a node of its own
  std::map<BoxKey, int> cell_at;

  double thickness_um() const { return lines.z_um.back(); }
  std::string extent() const;  ///< along x and y, for messages
};

/// Halve cells, keeping neighbours within one level of each other, until `is_too_large` holds of none. It must hold of
/// no part of a cell of which it does not hold.
/// @throws NotSolved where the cells grow beyond `most_cells`
BlockMesh make_block_mesh(const GridLines& lines, const std::function<bool(const Box&)>& is_too_large,
                          std::int64_t most_cells, int threads);

/// The cell that holds a point of a depth within the block; -1 beside the block.
int cell_holding(const BlockMesh& mesh, const std::array<double, 3>& point_um);

/// What `memory_limit_GB` means: 0 is four fifths of the machine's memory.
double allowed_GB(double memory_limit_GB);

}  // namespace mbtfm::elements
