/// What a column of a finite element solution is loaded with.
#pragma once

#include <utility>
#include <vector>

#include "substrate/compliance.h"

namespace mbtfm::substrate {

/// Forces (nN) on some ellipses, by index.
using LoadCase = std::vector<std::pair<int, Vec2>>;

/// The case of a column of the compliance matrix: 1 nN along x or y on one ellipse.
inline LoadCase unit_case(int column) { return {{column / 2, column % 2 == 0 ? Vec2{1, 0} : Vec2{0, 1}}}; }

inline LoadCase case_of(const std::vector<Vec2>& forces_nN) {
  LoadCase load;
  for (std::size_t j = 0; j < forces_nN.size(); ++j) load.emplace_back(static_cast<int>(j), forces_nN[j]);
  return load;
}

/// A column of x, y by point.
inline std::vector<Vec2> vectors_of(const Eigen::MatrixXd& column) {
  std::vector<Vec2> vectors(column.rows() / 2);
  for (std::size_t i = 0; i < vectors.size(); ++i) vectors[i] = {column(2 * i, 0), column(2 * i + 1, 0)};
  return vectors;
}

}  // namespace mbtfm::substrate
