/// Scenes and measures for tests of the substrate.
#pragma once

#include "substrate/compliance.h"
#include "tests/support/test.h"

namespace mbtfm::test {

inline Gel gel_of(double poisson_ratio, double thickness_um) {
  return {.youngs_modulus_kPa = 8.4, .poisson_ratio = poisson_ratio, .thickness_um = thickness_um};
}

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
inline std::vector<substrate::Ellipse> scattered_ellipses(int n, double radius_um, std::uint64_t seed = 1) {
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<substrate::Ellipse> ellipses;
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
  for (Eigen::Index j = 0; j + 1 < matrix.cols(); j += 2)
    sum += (matrix - reference).middleCols(j, 2).norm() / reference.middleCols(j, 2).norm();
  return 2 * sum / static_cast<double>(matrix.cols());
}

struct ColumnErrors {
  double all = 0, outside = 0, inside = 0;  ///< relative L2 by ellipse, mean over those with points there
  double worst_outside = 0;
};

inline bool is_inside(const substrate::Ellipse& e, Vec2 point) {
  const Vec2 along = {std::cos(e.angle_rad), std::sin(e.angle_rad)};
  const Vec2 offset = point - e.centre_um;
  return std::hypot(dot(offset, along) / e.semi_major_um, cross(along, offset) / e.semi_minor_um) <= 1;
}

/// Errors of each ellipse's pair of columns, at the points beside the ellipse itself and at those on it.
inline ColumnErrors column_errors(const Eigen::MatrixXd& matrix, const Eigen::MatrixXd& reference,
                                  const std::vector<Vec2>& points, const std::vector<substrate::Ellipse>& ellipses) {
  ColumnErrors errors;
  int n_inside = 0;
  for (std::size_t j = 0; j < ellipses.size(); ++j) {
    double error[2] = {}, size[2] = {};
    for (std::size_t i = 0; i < points.size(); ++i) {
      const int where = is_inside(ellipses[j], points[i]) ? 1 : 0;
      const auto exact = reference.block<2, 2>(2 * i, 2 * j);
      error[where] += (matrix.block<2, 2>(2 * i, 2 * j) - exact).squaredNorm();
      size[where] += exact.squaredNorm();
    }
    const double outside = std::sqrt(error[0] / size[0]);
    errors.all += std::sqrt((error[0] + error[1]) / (size[0] + size[1]));
    errors.outside += outside;
    errors.worst_outside = std::max(errors.worst_outside, outside);
    if (size[1] == 0) continue;
    errors.inside += std::sqrt(error[1] / size[1]);
    ++n_inside;
  }
  errors.all /= static_cast<double>(ellipses.size());
  errors.outside /= static_cast<double>(ellipses.size());
  if (n_inside > 0) errors.inside /= n_inside;
  return errors;
}

inline substrate::SubstrateParameters model_named(const std::string& name) {
  substrate::SubstrateParameters parameters;
  parameters.model = named<substrate::ModelKind>(name).value();
  return parameters;
}

}  // namespace mbtfm::test
