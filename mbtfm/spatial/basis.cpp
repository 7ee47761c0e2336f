#include "mbtfm/spatial/basis.h"

#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::spatial {

MatrixXd Basis::response(const MatrixXd& by_traction, int threads) const {
  const Index n = shapes_.rows();
  MatrixXd response(by_traction.rows(), 3 * size()), columns(by_traction.rows(), n);
  for (Index c = 0; c < 3; ++c) {
    for (Index v = 0; v < n; ++v) columns.col(v) = by_traction.col(3 * v + c);
    response.middleCols(c * size(), size()) = numerics::product(columns, shapes_, threads);
  }
  return response;
}

VectorXd Basis::tractions(const VectorXd& x) const {
  const Index n = shapes_.rows();
  VectorXd t(3 * n);
  for (Index c = 0; c < 3; ++c) {
    const VectorXd of_component = numerics::matvec(shapes_, x.segment(c * size(), size()));
    for (Index v = 0; v < n; ++v) t[3 * v + c] = of_component[v];
  }
  return t;
}

VectorXd Basis::transposed(const VectorXd& by_vertex) const {
  const Index n = shapes_.rows();
  VectorXd x(3 * size()), of_component(n);
  for (Index c = 0; c < 3; ++c) {
    for (Index v = 0; v < n; ++v) of_component[v] = by_vertex[3 * v + c];
    x.segment(c * size(), size()) = numerics::transposed_matvec(shapes_, of_component);
  }
  return x;
}

MatrixXd Basis::covariance(const MatrixXd& of_x, int threads) const {
  const Index n = shapes_.rows(), m = size();
  MatrixXd by_vertex(3 * n, 3 * n);
  const MatrixXd transposed = shapes_.transpose();
  for (Index c = 0; c < 3; ++c) {
    for (Index d = 0; d <= c; ++d) {
      const MatrixXd half = numerics::product(of_x.block(c * m, d * m, m, m), transposed, threads);
      const MatrixXd block = numerics::product(shapes_, half, threads);
      for (Index v = 0; v < n; ++v) {
        for (Index w = 0; w < n; ++w) {
          by_vertex(3 * v + c, 3 * w + d) = block(v, w);
          by_vertex(3 * w + d, 3 * v + c) = block(v, w);
        }
      }
    }
  }
  return by_vertex;
}

MatrixXd norm_of(const TractionMesh& mesh, const Ground& ground, const std::function<double(Vec2)>& amplitude) {
  constexpr int kParts = 6;  // of a side: the amplitude jumps at a rim
  MatrixXd norm = MatrixXd::Zero(mesh.n_vertices(), mesh.n_vertices());
  over_faces(mesh, ground, kParts, Places::even, [&](Vec2 at, std::span<const VertexShare> shares, double area_um2) {
    const double a = amplitude(at);
    for (const auto& [v, of_v] : shares) {
      for (const auto& [w, of_w] : shares) norm(v, w) += of_v * of_w * area_um2 / (a * a);
    }
  });
  return norm;
}

Basis orthonormal_basis(MatrixXd norm_um2) {
  MBTFM_ASSERT(numerics::upper_cholesky(norm_um2));
  MatrixXd shapes = MatrixXd::Identity(norm_um2.rows(), norm_um2.cols());
  numerics::solve_upper(norm_um2, shapes);
  return Basis(std::move(shapes));
}

Basis spot_basis(const TractionMesh& mesh, const Ground& ground, double width_um) {
  const Index n = mesh.n_vertices();
  const auto place = [&](Index v) {
    const Vec2 at = mesh.quads.points_um[v];
    return Vec3{at.x, at.y, ground.height_um(at)};
  };
  const Eigen::Map<const VectorXd> areas(mesh.areas_um2.data(), n);
  MatrixXd shapes(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      const double away = norm(place(i) - place(j)) / width_um;
      shapes(i, j) = std::exp(-0.5 * away * away) * areas[j];
    }
    shapes.row(i) /= shapes.row(i).sum();
  }
  return Basis(shapes * areas.cwiseSqrt().cwiseInverse().asDiagonal());
}

double spot_width_um(double bead_distance_um) {
  // as wide, at half their height, as 1.3 distances: measured, with 0.9 and 1.7 of them maps are 7 to 20 % worse
  // (notes/tractions_in_space.md)
  constexpr double kDistances = 0.55;
  return kDistances * bead_distance_um;
}

}  // namespace mbtfm::spatial
