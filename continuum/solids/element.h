/// Bent squares of high order in the half plane (r, z) of a solid that is the same all round its axis.
///
/// The displacement is a polynomial of the element's order along both sides. The pressure is one of a degree less in
/// both together, discontinuous, so that it is eliminated element by element:
///
///   energy = 2 pi integral r [ mu E:E + lambda/2 (P tr E)² + contraction tr E ] dr dz,   P: onto the pressures.
///
/// So nothing locks as Poisson's ratio comes near 1/2, and what jumps at the face between two solids stays in the
/// integral of each: nothing is smeared. E is the small strain, or that of Green and Lagrange (St Venant and
/// Kirchhoff). Source: Boffi, Brezzi, Fortin, Mixed Finite Element Methods (2013), §8.6; Schwab, p- and hp-Finite
/// Element Methods (1998), ch. 4 (corners).
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm::solids {

enum class Strain { small, large };
constexpr auto words(Strain) { return std::array{"small", "large"}; }

/// Of a part of the body.
struct Solid {
  double youngs_modulus_kPa = 0, poisson_ratio = 0;  ///< the ratio below 1/2
  double contraction_kPa = 0;                        ///< the same along all axes; pulls together where positive

  double shear_modulus_kPa() const { return youngs_modulus_kPa / (2 * (1 + poisson_ratio)); }
  double lame_modulus_kPa() const { return 2 * shear_modulus_kPa() * poisson_ratio / (1 - 2 * poisson_ratio); }
  /// How far it would shorten if nothing held it.
  double free_contraction() const { return contraction_kPa * (1 - 2 * poisson_ratio) / youngs_modulus_kPa; }
};

using Nodes = Eigen::Matrix2Xd;  ///< by node (u fastest, then v): r and z, of a position or displacement (um)

/// The square [0, 1]² with its nodes and its rule of quadrature.
class Square {
 public:
  explicit Square(int order);
  /// Points of the rule along a side: exact for what a bent element makes of degree 2 p.
  static constexpr int kMoreThanOrder = 2;

  int order() const { return order_; }
  int n_nodes() const { return (order_ + 1) * (order_ + 1); }
  int n_pressures() const { return order_ * (order_ + 1) / 2; }
  /// Places of the nodes along a side: those of Gauss and Lobatto.
  const std::vector<double>& nodes() const { return nodes_; }
  struct OneSide {
    std::vector<double> values, slopes;
  };
  OneSide along_side(double unit) const;  ///< Lagrange's polynomials of the nodes along a side
  Eigen::VectorXd shapes_at(Vec2 unit) const;
  Eigen::MatrixX2d slopes_at(Vec2 unit) const;  ///< along u, along v

  struct Point {
    double weight;
    Eigen::VectorXd shapes;
    Eigen::MatrixX2d slopes;
    Eigen::VectorXd pressures;
  };
  const std::vector<Point>& points() const { return points_; }

 private:
  int order_;
  std::vector<double> nodes_;
  std::vector<Point> points_;
};

/// Of an element about a displacement.
struct Equations {
  Eigen::MatrixXd stiffness;  ///< of row and column 2 k + i: node k, axis i; nN/um. Empty where not asked for
  Eigen::VectorXd forces_nN;  ///< slope of the energy
  double energy_fJ = 0;
  bool is_sound = true;  ///< not turned inside out; else the rest is not set
};

enum class Wanted { forces, stiffness };
Equations equations_of(const Square& square, const Nodes& positions_um, const Nodes& displacement_um,
                       const Solid& solid, Strain strain, Wanted wanted);

/// Stress (Cauchy's for small strains, second of Piola and Kirchhoff for large ones), with contraction: rr, tt, zz, rz.
Eigen::Vector4d stress_kPa(const Square& square, const Nodes& positions_um, const Nodes& displacement_um,
                           const Solid& solid, Strain strain, Vec2 unit);

/// Least over the rule's points of det J / (|J_u| |J_v|): the sine of the angle between its lines; negative: turned
/// over.
double least_sine(const Square& square, const Nodes& positions_um);

}  // namespace mbtfm::solids
