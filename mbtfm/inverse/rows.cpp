#include "mbtfm/inverse/rows.h"

#include <algorithm>
#include <cmath>

namespace mbtfm::inverse {

VectorXd components_of(const DisplacementField& beads) {
  VectorXd components(2 * std::ssize(beads));
  for (Index i = 0; i < std::ssize(beads); ++i)
    components.segment<2>(2 * i) << beads[i].displacement_um.x, beads[i].displacement_um.y;
  return components;
}

WeightedBeads weighted(const DisplacementField& beads, double sum) {
  VectorXd weights = VectorXd::Ones(std::ssize(beads));
  const bool states_errors = state_errors(beads);
  for (Index i = 0; states_errors && i < weights.size(); ++i) weights[i] = 1 / (beads[i].sigma_um * beads[i].sigma_um);
  const double scale = sum / weights.sum();
  VectorXd roots(2 * weights.size());
  for (Index i = 0; i < weights.size(); ++i) roots.segment<2>(2 * i).setConstant(std::sqrt(scale * weights[i]));
  VectorXd data = roots.cwiseProduct(components_of(beads));
  return {std::move(roots), std::move(data), states_errors ? std::optional(scale) : std::nullopt};
}

MatrixXd affine_motions(const DisplacementField& beads) {
  std::vector<Vec3> beads_um;
  for (const Bead& bead : beads) beads_um.push_back({bead.position_um.x, bead.position_um.y, 0});
  const Index n = std::ssize(beads);
  return affine_motions(beads_um).leftCols(6).reshaped(3, 6 * n).topRows(2).reshaped(2 * n, 6);
}

MatrixXd affine_motions(const std::vector<Vec3>& beads_um) {
  Vec3 sum;
  for (const Vec3& bead : beads_um) sum += bead;
  const Vec3 centre = 1 / std::max<double>(1, static_cast<double>(beads_um.size())) * sum;
  MatrixXd motions(3 * std::ssize(beads_um), 9);
  for (Index i = 0; i < std::ssize(beads_um); ++i) {
    const Vec3 d = beads_um[i] - centre;
    motions.middleRows<3>(3 * i) << 1, 0, -d.y, d.x, d.x, d.y, 0, 0, d.z,  //
        0, 1, d.x, d.y, -d.y, d.x, 0, -d.z, 0,                             //
        0, 0, 0, d.z, 0, 0, 1, d.y, -d.x;
  }
  return motions;
}

Rows::Rows(VectorXd weights, const MatrixXd& beside) : weights_(std::move(weights)) {
  if (beside.cols() == 0) return;
  weighted_beside_ = weights_.asDiagonal() * beside;
  basis_ = numerics::orthonormal_basis(weighted_beside_);
}

MatrixXd Rows::of(const MatrixXd& by_row) const {
  MatrixXd weighted = weights_.asDiagonal() * by_row;
  if (basis_.cols() > 0)
    weighted -= numerics::small_product(basis_, numerics::small_transposed_product(basis_, weighted));
  return weighted;
}

MatrixXd Rows::transposed(const MatrixXd& weighted) const {
  if (basis_.cols() == 0) return weights_.asDiagonal() * weighted;
  return weights_.asDiagonal() *
         (weighted - numerics::small_product(basis_, numerics::small_transposed_product(basis_, weighted)));
}

MatrixXd Rows::beside_in(const MatrixXd& by_row) const {
  return numerics::shortest_solution(weighted_beside_, weights_.asDiagonal() * by_row);
}

MatrixXd Rows::covariance_beside() const {
  return numerics::inverse_symmetric(numerics::small_transposed_product(weighted_beside_, weighted_beside_));
}

VectorXd direction_of(const numerics::VectorView& vector) {
  const double length = vector.norm();
  return length > 0 ? VectorXd(vector / length) : VectorXd::Unit(vector.size(), 0);
}

double error_along(const numerics::VectorView& vector, const numerics::MatrixView& covariance) {
  return std::sqrt(std::max(0.0, numerics::quadratic_form(covariance, direction_of(vector))));
}

}  // namespace mbtfm::inverse
