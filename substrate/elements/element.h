/// A bent hexahedron of 27 nodes: position and displacement are both quadratic along each of its unit coordinates.
///
/// The pressure is linear in space within each element (not in the unit coordinates: on bent elements that would lose
/// an order), and discontinuous, so that it is eliminated element by element: Q2-P1disc. Source: Boffi, Brezzi, Fortin,
/// Mixed Finite Element Methods (2013), §8.6; Arnold, Boffi, Falk, Math. Comp. 71 (2002) 909 (what mapping costs).
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "substrate/material.h"

namespace mbtfm::elements {

inline constexpr int kNodes = 27;             ///< x fastest, then y, then z
inline constexpr int kPressures = 4;          ///< 1, x, y, z from the middle
inline constexpr int kUnknowns = 3 * kNodes;  ///< 3 k + i is axis i of node k

using NodePositions = Eigen::Matrix<double, 3, kNodes>;  ///< um
using NodeValues = Eigen::Matrix<double, 3, kNodes>;
using Shapes = Eigen::Matrix<double, kNodes, 1>;
using Slopes = Eigen::Matrix<double, kNodes, 3>;

/// Unit coordinates of a node.
inline Eigen::Vector3d unit_of_node(int k) { return {0.5 * (k % 3), 0.5 * (k / 3 % 3), 0.5 * (k / 9)}; }
/// Shape functions on [0, 1], and their slopes.
std::array<double, 3> shape_values(double t);
std::array<double, 3> shape_slopes(double t);
/// Shape functions at a point of [0, 1]³, and their slopes by unit coordinate.
Shapes shapes_at(const Eigen::Vector3d& unit);
Slopes unit_slopes_at(const Eigen::Vector3d& unit);

/// A point of the rule of quadrature: Gauss, three along each side.
struct QuadraturePoint {
  Eigen::Vector3d position_um;
  double volume_um3 = 0;  ///< its weight
  Slopes slopes;          ///< 1/um
  Eigen::Vector4d pressures;
};

/// 1, and x, y, z from the middle over the size of the element.
Eigen::Vector4d pressures_at(const NodePositions& nodes_um, const Eigen::Vector3d& position_um);

/// Of the rule's point q, in any element.
const Shapes& shapes_of_point(int q);

struct Element {
  explicit Element(const NodePositions& nodes_um);
  std::vector<QuadraturePoint> points;
  Eigen::Matrix4d mass;  ///< of the pressures, um³
};

/// The least over the nodes of det(J) / (|J_1| |J_2| |J_3|), J the slopes of the position: 1 for a box, 0 where it
/// is flat, below 0 where it is turned inside out.
double least_scaled_jacobian(const NodePositions& nodes_um);

/// 2 mu (eps u, eps v) + lambda (P div u, P div v), P the projection onto the pressures; the modulus may change with z.
/// So the pressure of a mixed method is eliminated, the matrix stays positive definite, and nothing locks as nu -> 1/2.
Eigen::MatrixXd linear_stiffness(const Element& element, const substrate::Material& material);

/// Of the face z = 0 of the unit cube, at unit coordinates x, y.
struct FacePoint {
  Eigen::Vector3d position_um;
  Eigen::Vector3d area_um2;  ///< outward normal times the area of the face by that of the unit square
};
FacePoint face_point(const NodePositions& nodes_um, double x, double y);

}  // namespace mbtfm::elements
