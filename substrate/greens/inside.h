/// The inside of a flat gel under point forces on its surface, in any direction: all nine components at any depth.
///
/// In Fourier space, with z into the gel and x = kh, a wave of traction moves depth z by 1/(mu k) times
///
///   along the wave vector k:   U_t(x, z/h) of a traction along k,    U_n of one into the gel, a quarter wave behind
///   into the gel:              W_t, a quarter wave ahead,            W_n
///   across k:                  sinh(x - kz) / cosh x of a traction across k
///
/// and in space, with e = r/|r|,
///
///   G_along  = S I + D (2 e e^T - I),   S, D = ± 1/(4 pi mu) ∫ (U_t ± T) J_0,2(kr) dk
///   u_z of a force along the surface    =  (F . e) / (2 pi mu) ∫ W_t J1(kr) dk
///   u_r of a force into the gel         = - F_z / (2 pi mu) ∫ U_n J1(kr) dk
///   u_z of a force into the gel         =   F_z / (2 pi mu) ∫ W_n J0(kr) dk
///
/// What the base adds to the half-space's closed form is smooth, as if its source lay 2h - z away: it is tabulated.
/// Source: Papkovich's general solution, u = kappa psi e_z - grad(z psi + phi) (Barber, Elasticity, ch. 21); the
/// half-space after Boussinesq and Cerruti (Johnson, Contact Mechanics, eqs. 3.18 and 3.75).
#pragma once

#include <Eigen/Core>
#include <array>
#include <vector>

#include "pipeline/contract/gel.h"
#include "substrate/ellipse.h"

namespace mbtfm::greens {

/// Displacement (um) of the half-space at depth z_um >= 0 by unit forces (1 nN) at the origin of its surface: rows are
/// x, y, z (into the gel), columns forces along them. Not at the origin itself.
Eigen::Matrix3d half_space_inside_um_per_nN(const Gel& gel, Vec2 offset_um, double z_um);

/// What the base adds to W_t at the surface, x = kh > 0.
double base_down_by_along(double poisson_ratio, double x);

/// What a rigid base adds, times 2 pi mu h, as functions of r/h and z/h.
class BaseTable {
 public:
  explicit BaseTable(double poisson_ratio);
  /// S, D, and the integrals of W_t, U_n and W_n, less those of the half-space.
  struct Value {
    double s = 0, d = 0, down_by_along = 0, out_by_down = 0, down_by_down = 0;
  };
  /// @param r  distance over thickness, in [0, kReach) @param z  depth over thickness, in [0, 1]
  Value at(double r, double z) const;

  static constexpr double kReach = 40;  ///< as LayerTable's

 private:
  static constexpr int kFunctions = 5;
  std::vector<std::array<double, kFunctions>> values_;  ///< at Chebyshev nodes: pieces of r, their nodes, nodes of z
};

/// The layer on a rigid base.
class LayerInside {
 public:
  /// @throws InvalidData as check(gel)
  explicit LayerInside(const Gel& gel);
  /// As half_space_inside_um_per_nN, to 1e-9 of the largest component. @param z_um  in [0, thickness]
  Eigen::Matrix3d compliance_um_per_nN(Vec2 offset_um, double z_um) const;
  /// What the base adds to the half-space's; smooth everywhere.
  Eigen::Matrix3d base_part_um_per_nN(Vec2 offset_um, double z_um) const;

 private:
  Gel gel_;
  BaseTable table_;
};

/// The same by a unit force spread evenly over an ellipse of the surface. Seen from the point's projection, the
/// ellipse's area is swept by the ray to its rim: with s its length, R² = s² + z² and q = 1 - 2 nu, the half-space's
/// kernels have closed integrals along the ray, and of the one along the rim the trapezoidal rule converges
/// exponentially. On the surface itself the chords' moments take its place (half_space.h).
class EllipseInside {
 public:
  /// @param layer  null: the half-space; else it must outlive this
  EllipseInside(const Gel& gel, const LayerInside* layer, const substrate::Ellipse& ellipse);
  /// To 1e-8 of the largest component, on the surface itself, too; nearer to the rim than 1e-3 semi-axes to 1e-5.
  Eigen::Matrix3d compliance_um_per_nN(Vec2 point_um, double z_um) const;

 private:
  Eigen::Matrix3d half_space(Vec2 point_um, double z_um) const;
  Eigen::Matrix3d half_space_at_surface(Vec2 point_um) const;
  Gel gel_;
  const LayerInside* layer_;
  substrate::Ellipse ellipse_;
  double cos_, sin_;
  std::vector<substrate::DiscPoint> base_rule_;
};

}  // namespace mbtfm::greens
