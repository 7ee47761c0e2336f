/// Tractions as sums of shapes.
#pragma once

#include <utility>

#include <Eigen/Core>

#include "mbtfm/spatial/traction_mesh.h"

namespace mbtfm::spatial {

/// t = L x for each component: L has a row for each vertex, x a number for each shape and component (all of x, then
/// those of y, then of z). Tractions are by vertex: x, y, z of each in turn.
class Basis {
 public:
  explicit Basis(Eigen::MatrixXd shapes) : shapes_(std::move(shapes)) {}

  const Eigen::MatrixXd& shapes() const { return shapes_; }
  Eigen::Index size() const { return shapes_.cols(); }
  /// G L, where u = G t.
  Eigen::MatrixXd response(const Eigen::MatrixXd& by_traction, int threads) const;
  Eigen::VectorXd tractions(const Eigen::VectorXd& x) const;
  /// Lᵀ of numbers by vertex.
  Eigen::VectorXd transposed(const Eigen::VectorXd& by_vertex) const;
  /// L C Lᵀ, by vertex
  Eigen::MatrixXd covariance(const Eigen::MatrixXd& of_x, int threads) const;

 private:
  Eigen::MatrixXd shapes_;
};

/// ∫ φ φᵀ / a² dA with the shape functions φ of the vertices and the amplitude a that is expected of a place.
Eigen::MatrixXd norm_of(const TractionMesh& mesh, const Ground& ground, const std::function<double(Vec2)>& amplitude);

/// L = R⁻¹, RᵀR the norm: |x|² = ∫ |t|²/a² dA, whatever the mesh.
Basis orthonormal_basis(Eigen::MatrixXd norm_um2);

/// Spots: each is a Gaussian of the distance in space, weighed by area so that an x of one on all of them is a traction
/// of one everywhere; and scaled so that |x|² is the integral of the squares of what was smoothed.
/// @param width_um  standard deviation
Basis spot_basis(const TractionMesh& mesh, const Ground& ground, double width_um);

/// The width of spots that beads at this distance tell apart.
double spot_width_um(double bead_distance_um);

}  // namespace mbtfm::spatial
