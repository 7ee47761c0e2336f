/// A contracting elastic sheet in plane stress, as its equations have it. docs/theory/sheets.md.
///
///   S = M [(1 − nu) eps + nu tr(eps) 1] + s 1,   M = E h / (1 − nu²),   div S = T,   S n = −(Λ / R) n at the edge
///
/// S is a tension (nN/um), T the traction of the sheet on its ground (kPa); s > 0 pulls together.
#pragma once

#include <array>
#include <vector>

#include "continuum/sheet/elements.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::sheet {

struct Material {
  double youngs_modulus_kPa = 0;
  double poisson_ratio = 0.5;
  double thickness_um = 0;
  /// M, nN/um
  double stiffness_nN_per_um() const { return youngs_modulus_kPa * thickness_um / (1 - poisson_ratio * poisson_ratio); }
  /// E h, nN/um
  double youngs_tension_nN_per_um() const { return youngs_modulus_kPa * thickness_um; }
};

/// A symmetric tensor of the plane.
struct Tensor {
  double xx = 0, yy = 0, xy = 0;
};
inline Tensor operator+(const Tensor& a, const Tensor& b) { return {a.xx + b.xx, a.yy + b.yy, a.xy + b.xy}; }
inline Tensor operator*(double f, const Tensor& a) { return {f * a.xx, f * a.yy, f * a.xy}; }
inline double mean_of(const Tensor& a) { return 0.5 * (a.xx + a.yy); }
inline double largest_shear(const Tensor& a) { return std::hypot(0.5 * (a.xx - a.yy), a.xy); }
/// M [(1 − nu) eps + nu tr(eps) 1]
Tensor elastic_tension(const Material& material, const Tensor& strain);

/// What a sheet is, at the points of its elements (kPoints for each triangle, in turn).
struct Sheet {
  Material material;
  std::vector<double> contraction_nN_per_um;  ///< s
  std::vector<double> spring_nN_per_um3;      ///< of the ground; empty: none
  double line_tension_nN = 0;                 ///< of a cable along the rims
  int n_rims = 1;                             ///< curves 0 … n_rims − 1 are rims
  std::vector<std::array<bool, 2>> held;      ///< by node, along x and y; empty: none
};
/// The same everywhere.
std::vector<double> even(const Elements& elements, double value);

/// Displacements x, y by node.
using NodeVectors = VectorXd;
inline Vec2 at_node(const NodeVectors& u, int node) { return {u(2 * node), u(2 * node + 1)}; }
/// At a point.
Vec2 value_of(const NodeVectors& u, const std::array<int, 6>& nodes, const Shape& shape);
/// du_i/dx_j
Eigen::Matrix2d gradient_of(const NodeVectors& u, const std::array<int, 6>& nodes, const Shape& shape);
Tensor strain_of(const NodeVectors& u, const std::array<int, 6>& nodes, const Shape& shape);

/// Forces of contraction and line tension on the nodes, of the sheet at rest.
NodeVectors forces_of_contraction_nN(const Elements& elements, const Sheet& sheet);

/// S at each point of the elements, of small strains.
std::vector<Tensor> tension_at_points(const Elements& elements, const Sheet& sheet, const NodeVectors& u);

}  // namespace mbtfm::sheet
