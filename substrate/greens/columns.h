/// Matrices whose columns are functions of the load and the point.
#pragma once

#include <vector>

#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/parallel.h"
#include "substrate/greens/half_space.h"

namespace mbtfm::greens {

/// Fill the matrix column pair by column pair: field_of(load) has the compliance at a point.
template <class Load, class FieldOf>
MatrixXd compliance_by_columns(const std::vector<Vec2>& points_um, const std::vector<Load>& loads, int threads,
                               const FieldOf& field_of) {
  MatrixXd matrix(2 * points_um.size(), 2 * loads.size());
  numerics::parallel_for(static_cast<int>(loads.size()), threads, [&](int j) {
    const auto field = field_of(loads[j]);
    double* along_x = matrix.col(2 * j).data();
    double* along_y = matrix.col(2 * j + 1).data();
    for (std::size_t i = 0; i < points_um.size(); ++i) {
      const Sym2 g = field.compliance_um_per_nN(points_um[i]);
      along_x[2 * i] = g.xx;
      along_x[2 * i + 1] = g.xy;
      along_y[2 * i] = g.xy;
      along_y[2 * i + 1] = g.yy;
    }
  });
  return matrix;
}

}  // namespace mbtfm::greens
