/// How points of the gel answer to forces on ellipses: the linear map of compliance.h as an operator, so that a scene
/// with hundreds of thousands of points and thousands of ellipses fits into memory.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "substrate/compliance.h"

namespace mbtfm::substrate {

/// u = G F: rows 2i, 2i+1 are x, y of point i (um), columns 2j, 2j+1 a force along x, y on ellipse j (nN).
class Response {
 public:
  virtual ~Response() = default;
  virtual Eigen::Index rows() const = 0;
  virtual Eigen::Index cols() const = 0;
  /// G F: rows() × any number
  virtual Eigen::MatrixXd displace(const Eigen::MatrixXd& forces_nN) const = 0;
  /// Gᵀ D: cols() × any number
  virtual Eigen::MatrixXd pull_back(const Eigen::MatrixXd& displacements) const = 0;
  /// Gᵀ diag(weight) G, on and above its diagonal; zero or rubbish below
  /// @param weight  by row, not negative
  virtual Eigen::MatrixXd upper_gram(const Eigen::VectorXd& weight) const = 0;
  /// The same at some of the points, in this order.
  virtual std::shared_ptr<const Response> at_points(const std::vector<Eigen::Index>& points) const = 0;
};
using SharedResponse = std::shared_ptr<const Response>;

/// All numbers in memory. @param compliance_um_per_nN  2·points × 2·ellipses
SharedResponse dense_response(Eigen::MatrixXd compliance_um_per_nN, int threads = 1);

/// Far fields interpolated: points in squares of some hundred; ellipses at three half sides or more from a square's
/// centre act on it by their field at 6 × 6 Chebyshev nodes, the nearer ones on each point by itself. Of each far
/// ellipse's field this leaves some (3 + 2 √2)⁻⁶ = 3e-5 at the worst, as 1/r is analytic in the ellipse through the
/// source (Trefethen, Approximation Theory and Approximation Practice, 2013, ch. 8).
/// @param model  one whose columns cost as much as they have points: half-space, layer
SharedResponse blocked_response(const Substrate& model, const std::vector<Vec2>& points_um,
                                const std::vector<Ellipse>& ellipses, int threads);

/// Whether the matrix would take more than 0.4 GB.
bool is_large(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses);

/// Dense, but blocked where it is large.
SharedResponse pointwise_response(const Substrate& model, const std::vector<Vec2>& points_um,
                                  const std::vector<Ellipse>& ellipses, int threads);

}  // namespace mbtfm::substrate
