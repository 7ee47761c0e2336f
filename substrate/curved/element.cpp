#include "substrate/curved/element.h"

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>
#include <array>
#include <limits>

#include "pipeline/numerics/quadrature.h"
#include "substrate/boxes/block_mesh.h"

namespace mbtfm::curved {
namespace {

constexpr int kRulePoints = 27;

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

Shapes shapes_at(const Eigen::Vector3d& unit) {
  const auto x = boxes::shape_values(2, unit.x()), y = boxes::shape_values(2, unit.y()),
             z = boxes::shape_values(2, unit.z());
  Shapes shapes;
  for (int k = 0; k < kNodes; ++k) shapes[k] = x[k % 3] * y[k / 3 % 3] * z[k / 9];
  return shapes;
}

Slopes unit_slopes_at(const Eigen::Vector3d& unit) {
  std::array<std::array<double, 3>, 3> value, slope;
  for (int axis = 0; axis < 3; ++axis) {
    value[axis] = boxes::shape_values(2, unit[axis]);
    slope[axis] = boxes::shape_slopes(2, unit[axis]);
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
  double least = std::numeric_limits<double>::infinity();
  for (int k = 0; k < kNodes; ++k) {
    const Eigen::Matrix3d jacobian = nodes_um * unit_slopes_at(unit_of_node(k));
    const double lengths = jacobian.colwise().norm().prod();
    least = std::min(least, lengths > 0 ? jacobian.determinant() / lengths : 0.0);
  }
  return least;
}

Eigen::MatrixXd linear_stiffness(const Element& element, double mu_kPa, double lambda_kPa) {
  // by axis: the slopes of all points, scaled so that a product is an integral
  std::array<Eigen::Matrix<double, kRulePoints, kNodes>, 3> slopes;
  Eigen::Matrix<double, kUnknowns, kPressures> divergence = Eigen::Matrix<double, kUnknowns, kPressures>::Zero();
  for (int q = 0; q < kRulePoints; ++q) {
    const QuadraturePoint& point = element.points[q];
    for (int axis = 0; axis < 3; ++axis) {
      slopes[axis].row(q) = std::sqrt(mu_kPa * point.volume_um3) * point.slopes.col(axis).transpose();
    }
    const Eigen::Matrix<double, 3, kNodes, Eigen::ColMajor> by_node = point.slopes.transpose();
    divergence += point.volume_um3 * Eigen::Map<const Eigen::Matrix<double, kUnknowns, 1>>(by_node.data()) *
                  point.pressures.transpose();
  }
  // 2 mu eps : eps = mu (grad_a . grad_b d_ij + d_j N_a d_i N_b)
  Eigen::MatrixXd stiffness = lambda_kPa * divergence * element.mass.ldlt().solve(divergence.transpose());
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

}  // namespace mbtfm::curved
