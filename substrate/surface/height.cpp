#include "substrate/surface/height.h"

#include <Eigen/SparseLU>
#include <algorithm>
#include <cmath>

namespace mbtfm::surface {
namespace {

using Eigen::MatrixXd;

/// Of n values at the knots, one a row of each column, the n + 2 coefficients of their cubic spline.
MatrixXd interpolated(const MatrixXd& values) {
  const auto n = static_cast<int>(values.rows());
  std::vector<Eigen::Triplet<double>> entries;
  for (int k = 0; k < n; ++k) {
    entries.emplace_back(k + 1, k, 1. / 6);
    entries.emplace_back(k + 1, k + 1, 4. / 6);
    entries.emplace_back(k + 1, k + 2, 1. / 6);
  }
  constexpr std::array kFourthDifference = {1., -4., 6., -4., 1.};  // the step of the third derivative at a knot
  for (int k = 0; k < 5; ++k) {
    entries.emplace_back(0, k, kFourthDifference[k]);
    entries.emplace_back(n + 1, n - 3 + k, kFourthDifference[k]);
  }
  Eigen::SparseMatrix<double> matrix(n + 2, n + 2);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SparseLU<Eigen::SparseMatrix<double>> factor(matrix);
  MatrixXd right = MatrixXd::Zero(n + 2, values.cols());
  right.middleRows(1, n) = values;
  return factor.solve(right);
}

}  // namespace

Height::Height(const HeightMap& map) {
  check(map);
  lattice_ = {map.origin_um, map.spacing_um, map.n_x - 1, map.n_y - 1};
  const Eigen::Map<const MatrixXd> z(map.z_um.data(), map.n_x, map.n_y);
  const MatrixXd along_x = interpolated(z).transpose();
  const MatrixXd both = interpolated(along_x).transpose();
  coefficients_um_ = both.reshaped();
  mean_um_ = z.mean();
}

Vec2 Height::nearest(Vec2 at) const {
  return {std::clamp(at.x, low_um().x, high_um().x), std::clamp(at.y, low_um().y, high_um().y)};
}

bool Height::contains(Vec2 at) const {
  const Vec2 size = high_um() - low_um();
  return norm(at - nearest(at)) <= 1e-9 * norm(size);
}

double Height::operator()(Vec2 at) const {
  const Vec2 rim = nearest(at);
  const double at_rim = value_of(lattice_, weights_at(lattice_, rim), coefficients_um_);
  const double away = norm(at - rim);
  if (away == 0) return at_rim;
  const Vec2 size = high_um() - low_um();
  const double reach = 0.5 * std::min(size.x, size.y);
  // level at the rim, and where it ends
  const auto fade = [&](double within) {
    const double t = std::min(1.0, away / within);
    return std::pow(1 - t, 3) * (1 + 3 * t);
  };
  constexpr double kShareOfSlope = 0.25;  // rises by a twentieth of slope times reach at most
  return mean_um_ + (at_rim - mean_um_) * fade(reach) + dot(slope(rim), at - rim) * fade(kShareOfSlope * reach);
}

Vec2 Height::slope(Vec2 at) const {
  const SlopeWeights w = slope_weights_at(lattice_, at);
  return {value_of(lattice_, w.x, coefficients_um_), value_of(lattice_, w.y, coefficients_um_)};
}

}  // namespace mbtfm::surface
