#include "substrate/elements/element.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <limits>

#include "pipeline/numerics/quadrature.h"

namespace mbtfm::elements {
namespace {

constexpr int kRulePoints = 27, kMiddle = 13;

struct UnitRule {
  std::array<double, kRulePoints> weight{};
  std::array<Shapes, kRulePoints> shapes;
  std::array<Slopes, kRulePoints> slopes;
};

const UnitRule& unit_rule() {
  static const UnitRule rule = [] {
    const numerics::GaussRule gauss = numerics::gauss_legendre(3);
    UnitRule made;
    for (int point = 0; point < kRulePoints; ++point) {
      const int index[3] = {point % 3, point / 3 % 3, point / 9};
      Eigen::Vector3d unit;
      made.weight[point] = 1;
      for (int axis = 0; axis < 3; ++axis) {
        unit[axis] = 0.5 * (1 + gauss.nodes[index[axis]]);
        made.weight[point] *= 0.5 * gauss.weights[index[axis]];
      }
      made.shapes[point] = shapes_at(unit);
      made.slopes[point] = unit_slopes_at(unit);
    }
    return made;
  }();
  return rule;
}

}  // namespace

std::array<double, 3> shape_values(double t) { return {(1 - t) * (1 - 2 * t), 4 * t * (1 - t), t * (2 * t - 1)}; }
std::array<double, 3> shape_slopes(double t) { return {4 * t - 3, 4 - 8 * t, 4 * t - 1}; }

Shapes shapes_at(const Eigen::Vector3d& unit) {
  const auto x = shape_values(unit.x()), y = shape_values(unit.y()), z = shape_values(unit.z());
  Shapes shapes;
  for (int k = 0; k < kNodes; ++k) shapes[k] = x[k % 3] * y[k / 3 % 3] * z[k / 9];
  return shapes;
}

Slopes unit_slopes_at(const Eigen::Vector3d& unit) {
  std::array<std::array<double, 3>, 3> value, slope;
  for (int axis = 0; axis < 3; ++axis) {
    value[axis] = shape_values(unit[axis]);
    slope[axis] = shape_slopes(unit[axis]);
  }
  Slopes slopes;
  for (int k = 0; k < kNodes; ++k) {
    const int i = k % 3, j = k / 3 % 3, l = k / 9;
    slopes.row(k) << slope[0][i] * value[1][j] * value[2][l], value[0][i] * slope[1][j] * value[2][l],
        value[0][i] * value[1][j] * slope[2][l];
  }
  return slopes;
}

Eigen::Vector4d pressures_at(const NodePositions& nodes_um, const Eigen::Vector3d& position_um) {
  const Eigen::Array3d low = nodes_um.rowwise().minCoeff(), high = nodes_um.rowwise().maxCoeff();
  Eigen::Vector4d pressures;
  pressures << 1, ((2 * position_um.array() - low - high) / (high - low)).matrix();
  return pressures;
}

const Shapes& shapes_of_point(int q) { return unit_rule().shapes[q]; }

Element::Element(const NodePositions& nodes_um) : points(kRulePoints), mass(Eigen::Matrix4d::Zero()) {
  const UnitRule& rule = unit_rule();
  for (int q = 0; q < kRulePoints; ++q) {
    QuadraturePoint& point = points[q];
    const Eigen::Matrix3d jacobian = nodes_um * rule.slopes[q];  // d position_i / d unit_j
    point.position_um = nodes_um * rule.shapes[q];
    point.volume_um3 = rule.weight[q] * jacobian.determinant();
    point.slopes = rule.slopes[q] * jacobian.inverse();
    point.pressures = pressures_at(nodes_um, point.position_um);
    mass += point.volume_um3 * point.pressures * point.pressures.transpose();
  }
}

double least_scaled_jacobian(const NodePositions& nodes_um) {
  static const std::array<Slopes, kNodes> slopes_at_nodes = [] {
    std::array<Slopes, kNodes> slopes;
    for (int k = 0; k < kNodes; ++k) slopes[k] = unit_slopes_at(unit_of_node(k));
    return slopes;
  }();
  double least = std::numeric_limits<double>::infinity();
  for (const Slopes& slopes : slopes_at_nodes) {
    const Eigen::Matrix3d jacobian = nodes_um * slopes;
    const double lengths = jacobian.colwise().norm().prod();
    least = std::min(least, lengths > 0 ? jacobian.determinant() / lengths : 0.0);
  }
  return least;
}

Eigen::MatrixXd linear_stiffness(const Element& element, const substrate::Material& material) {
  const double mu_kPa = substrate::shear_modulus_kPa(material.gel), middle_um = element.points[kMiddle].position_um.z();
  // by axis: the slopes of all points, scaled so that a product is an integral
  std::array<Eigen::Matrix<double, kRulePoints, kNodes>, 3> slopes;
  Eigen::Matrix<double, kUnknowns, kPressures> divergence = Eigen::Matrix<double, kUnknowns, kPressures>::Zero();
  Eigen::Matrix4d compressibility = Eigen::Matrix4d::Zero();  // (q_m, q_n / lambda), times the gel's lambda
  for (int q = 0; q < kRulePoints; ++q) {
    const QuadraturePoint& point = element.points[q];
    const double modulus = substrate::relative_modulus(material, point.position_um.z(), middle_um);
    for (int axis = 0; axis < 3; ++axis) {
      slopes[axis].row(q) = std::sqrt(modulus * mu_kPa * point.volume_um3) * point.slopes.col(axis).transpose();
    }
    compressibility += point.volume_um3 / modulus * point.pressures * point.pressures.transpose();
    const Eigen::Matrix<double, 3, kNodes, Eigen::ColMajor> by_node = point.slopes.transpose();
    divergence += point.volume_um3 * Eigen::Map<const Eigen::Matrix<double, kUnknowns, 1>>(by_node.data()) *
                  point.pressures.transpose();
  }
  // 2 mu eps : eps = mu (grad_a . grad_b d_ij + d_j N_a d_i N_b)
  Eigen::MatrixXd stiffness =
      substrate::lame_modulus_kPa(material.gel) * divergence * compressibility.ldlt().solve(divergence.transpose());
  Eigen::Matrix<double, kNodes, kNodes> even = Eigen::Matrix<double, kNodes, kNodes>::Zero();
  const auto block = [&](int i, int j) {
    return stiffness(Eigen::seqN(i, Eigen::fix<kNodes>, 3), Eigen::seqN(j, Eigen::fix<kNodes>, 3));
  };
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j <= i; ++j) {
      const Eigen::Matrix<double, kNodes, kNodes> product = slopes[j].transpose() * slopes[i];
      block(i, j) += product;
      if (i == j) {
        even += product;
      } else {
        block(j, i) += product.transpose();
      }
    }
  }
  for (int i = 0; i < 3; ++i) block(i, i) += even;
  return stiffness;
}

FacePoint face_point(const NodePositions& nodes_um, double x, double y) {
  const Eigen::Vector3d unit(x, y, 0);
  const Eigen::Matrix3d jacobian = nodes_um * unit_slopes_at(unit);
  return {nodes_um * shapes_at(unit), jacobian.col(1).cross(jacobian.col(0))};
}

}  // namespace mbtfm::elements
