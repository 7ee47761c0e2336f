/// Scenes and measures for tests of the substrate.
#pragma once

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include "substrate/compliance.h"

namespace mbtfm::test {

using substrate::Ellipse;

/// Points spread over a square of the given half side about `centre`.
inline std::vector<Vec2> scattered_points(int n, double half_side_um, Vec2 centre_um = {}, std::uint64_t seed = 1) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> place(-half_side_um, half_side_um);
  std::vector<Vec2> points;
  for (int i = 0; i < n; ++i) {
    const double x = place(random);
    points.push_back(centre_um + Vec2{x, place(random)});
  }
  return points;
}

/// Ellipses of 0.5 to 5 um² and aspect 1.5 to 4 in a disc.
inline std::vector<Ellipse> scattered_ellipses(int n, double radius_um, std::uint64_t seed = 1) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<Ellipse> ellipses;
  for (int j = 0; j < n; ++j) {
    const double r = radius_um * std::sqrt(unit(random));
    const double direction = 2 * std::numbers::pi * unit(random);
    const double area = 0.5 + 4.5 * unit(random);
    const double aspect = 1.5 + 2.5 * unit(random);
    const double minor = std::sqrt(area / (std::numbers::pi * aspect));
    ellipses.push_back({.centre_um = {r * std::cos(direction), r * std::sin(direction)},
                        .semi_major_um = aspect * minor,
                        .semi_minor_um = minor,
                        .angle_rad = std::numbers::pi * unit(random)});
  }
  return ellipses;
}

/// Relative L2 difference of each ellipse's pair of columns, averaged over the ellipses.
inline double mean_column_difference(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& reference) {
  double sum = 0;
  for (Eigen::Index j = 0; j + 1 < matrix.cols(); j += 2) {
    sum += (matrix - reference).middleCols(j, 2).norm() / reference.middleCols(j, 2).norm();
  }
  return 2 * sum / static_cast<double>(matrix.cols());
}

inline substrate::SubstrateParameters model_named(const std::string& name) {
  substrate::SubstrateParameters parameters;
  parameters.model = name;
  return parameters;
}

}  // namespace mbtfm::test
