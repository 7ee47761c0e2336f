/// What a column of a finite element solution is loaded with.
#pragma once

#include <utility>
#include <vector>

#include "pipeline/numerics/cholesky.h"
#include "substrate/boxes/block_mesh.h"

namespace mbtfm::boxes {

/// Forces (nN) on some ellipses, by index.
using LoadCase = std::vector<std::pair<int, Vec2>>;

/// The case of a column of the compliance matrix: 1 nN along x or y on one ellipse.
inline LoadCase unit_case(int column) { return {{column / 2, column % 2 == 0 ? Vec2{1, 0} : Vec2{0, 1}}}; }

inline LoadCase case_of(const std::vector<Vec2>& forces_nN) {
  LoadCase load;
  for (std::size_t j = 0; j < forces_nN.size(); ++j) load.emplace_back(static_cast<int>(j), forces_nN[j]);
  return load;
}

/// Nodes that any of the points is a mean of.
inline std::vector<int> nodes_of(const std::vector<std::vector<NodeWeight>>& samples) {
  std::vector<int> nodes;
  for (const auto& sample : samples) {
    for (const NodeWeight& w : sample) nodes.push_back(w.node);
  }
  return nodes;
}

/// Add a solution at the points to a column, along some axes by point.
inline void add_samples(const std::vector<std::vector<NodeWeight>>& samples, const std::vector<int>& axes,
                        const numerics::NodalColumn& u, double* column) {
  for (const auto& sample : samples) {
    for (const int axis : axes) {
      for (const auto& [node, weight] : sample) *column += weight * u(node, axis);
      ++column;
    }
  }
}

}  // namespace mbtfm::boxes
