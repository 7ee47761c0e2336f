/// What `half-space` and `layer` share: columns from a function of the ellipse and the point.
#pragma once

#include <chrono>

#include "pipeline/numerics/parallel.h"
#include "substrate/greens/half_space.h"

namespace mbtfm::greens {

inline double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

/// Fill the matrix column pair by column pair: field_of(ellipse) has the compliance at a point.
template <class FieldOf>
Eigen::MatrixXd compliance_by_columns(const std::vector<Vec2>& points_um,
                                      const std::vector<substrate::Ellipse>& ellipses, int threads,
                                      const FieldOf& field_of) {
  substrate::check_points(points_um);
  check(ellipses);
  Eigen::MatrixXd matrix(2 * points_um.size(), 2 * ellipses.size());
  numerics::parallel_for(static_cast<int>(ellipses.size()), threads, [&](int j) {
    const auto field = field_of(ellipses[j]);
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
