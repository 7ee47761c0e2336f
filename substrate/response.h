/// How points of the gel answer to forces on ellipses: the linear map of compliance.h as an operator, so that a scene
/// with hundreds of thousands of points and thousands of ellipses fits into memory.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "pipeline/contract/geometry.h"
#include "pipeline/numerics/dense.h"
#include "substrate/ellipse.h"

namespace mbtfm::substrate {

class KeptResponse;
using SharedResponse = std::shared_ptr<const KeptResponse>;

class Response;
using LazyResponse = std::shared_ptr<const Response>;

/// About forces F₀: u(F) = displacement_um + response (F − F₀), to first order.
struct Tangent {
  VectorXd displacement_um;
  LazyResponse response;
};

/// u = G F, F the strengths of the loads by component, u the displacements (um) by component. For forces along the
/// surface and points of it: rows 2i, 2i+1 are x, y of point i, columns 2j, 2j+1 a force along x, y on ellipse j (nN).
/// Of a model that is not linear displace() and about() alone are the answer, the others its derivative at rest.
class Response : public std::enable_shared_from_this<Response> {
 public:
  virtual ~Response() = default;
  virtual Index rows() const = 0;
  virtual Index cols() const = 0;
  /// G F: rows() × any number
  virtual MatrixXd displace(const MatrixXd& forces_nN) const = 0;
  /// Gᵀ D: cols() × any number
  virtual MatrixXd pull_back(const MatrixXd& displacements) const = 0;
  /// G: rows() × cols(); not where it is too large to be held
  virtual MatrixXd matrix() const = 0;
  /// The same in memory, for many calls: as its matrix, or something that needs less room.
  virtual SharedResponse kept() const = 0;
  /// Of a linear model: its displacement, and itself. @param forces_nN  one column of displace()
  virtual Tangent about(const VectorXd& forces_nN) const { return {displace(forces_nN), shared_from_this()}; }
};

/// A response in memory, which needs its model no more.
class KeptResponse : public Response {
 public:
  MatrixXd matrix() const override;
  SharedResponse kept() const override { return std::static_pointer_cast<const KeptResponse>(shared_from_this()); }
  /// Gᵀ diag(weight) G, cols() square, on and above its diagonal; zero or rubbish below
  /// @param weight  by row, not negative
  virtual MatrixXd upper_gram(const VectorXd& weight) const = 0;
  /// The same at some of the points, in this order.
  virtual SharedResponse at_points(const std::vector<Index>& points) const = 0;
};

/// All numbers in memory. @param compliance_um_per_nN  2·points × 2·ellipses
SharedResponse dense_response(MatrixXd compliance_um_per_nN, int threads = 1);

/// How a model answers: by its matrix, by displacing, or both; what is empty is made of the other.
struct Answers {
  Index rows = 0, cols = 0;
  std::function<MatrixXd()> matrix = {};
  std::function<MatrixXd(const MatrixXd& forces_nN)> displace = {};
  std::function<SharedResponse()> kept = {};
  std::function<Tangent(const VectorXd& forces_nN)> about = {};
};
LazyResponse lazy_response(Answers answers);

/// Along the surface and into the gel, of one scene: x, y, z by point.
LazyResponse joined(LazyResponse along, LazyResponse normal);

/// The matrix of some points along the surface, of a model whose columns cost as much as they have points.
using MatrixAt = std::function<MatrixXd(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses)>;

/// Far fields interpolated: points in squares of some hundred; ellipses at three half sides or more from a square's
/// centre act on it by their field at 6 × 6 Chebyshev nodes, the nearer ones on each point by itself. Of each far
/// ellipse's field this leaves some (3 + 2 √2)⁻⁶ = 3e-5 at the worst, as 1/r is analytic in the ellipse through the
/// source (Trefethen, Approximation Theory and Approximation Practice, 2013, ch. 8).
SharedResponse blocked_response(const MatrixAt& matrix_at, const std::vector<Vec2>& points_um,
                                const std::vector<Ellipse>& ellipses, int threads);

/// Kept dense up to 0.4 GB, blocked beyond.
LazyResponse pointwise_response(MatrixAt matrix_at, const std::vector<Vec2>& points_um,
                                const std::vector<Ellipse>& ellipses, int threads);

}  // namespace mbtfm::substrate
