/// The laterally infinite elastic layer, bonded to a rigid base, under tangential forces on its surface.
///
/// In Fourier space a traction along the wave vector k gives a displacement A(k), one across it B(k) times itself:
///
///   mu k A = (1-nu) L(kh),  L(x) = (2 kappa sinh 2x + 4x) / (2 kappa cosh 2x + 1 + kappa² + 4x²),  kappa = 3 - 4 nu
///   mu k B = tanh(kh)
///
/// and in space G(r) = S(r) I + D(r) (2 e e^T - I), e = r/|r|, S and D Hankel transforms of order 0 and 2 of
/// (A+B)/2 and -(A-B)/2. Less the half-space's (L = tanh = 1) both are smooth, as if their source lay 2 h away.
/// Source: Hannah (1951), Q. J. Mech. Appl. Math. 4, 94 (tangential load); del Alamo et al., PNAS 110, 16361 (2013).
#pragma once

#include <array>
#include <vector>

#include "substrate/greens/half_space.h"

namespace mbtfm::greens {

/// S and D of the layer less those of the half-space, times 2 pi mu h, as functions of r/h: piecewise polynomials.
class LayerTable {
 public:
  explicit LayerTable(double poisson_ratio);
  struct Value {
    double s = 0, d = 0;
  };
  /// @param r  distance over thickness, in [0, kReach)
  Value correction(double r) const;

  /// Beyond this many thicknesses the layer's own displacement is taken as zero: it falls as exp(-0.739 r/h) for
  /// nu = 1/2 (first zero of cos y = y, a pole of L) and faster below: 2e-13 of a half-space's there.
  static constexpr double kReach = 40;
  static constexpr int kPiecesPerUnit = 8;
  static constexpr int kOrder = 8;  ///< coefficients a piece: r = 2i is 32 half pieces away, 64^-8 = 4e-15
  using Piece = std::array<Value, kOrder>;

 private:
  double poisson_ratio_;
  std::vector<Piece> pieces_;  ///< polynomials in t in [-1, 1] over 1/8 of a thickness each
};

/// The same at r = 0, without the table.
LayerTable::Value layer_correction_at_force(double poisson_ratio);

/// The layer with its table: displacements of its surface.
class Layer {
 public:
  /// @throws InvalidData as check(gel)
  explicit Layer(const Gel& gel);
  /// By a unit point force at the origin. @param offset_um  not zero
  Sym2 point_compliance_um_per_nN(Vec2 offset_um) const;
  /// The part by which a point force's field differs from the half-space's; smooth everywhere.
  Sym2 point_correction_um_per_nN(Vec2 offset_um) const;
  /// Its mean by a rule around the force.
  Sym2 mean_correction_um_per_nN(Vec2 offset_um, const std::vector<substrate::DiscPoint>& rule) const;
  const Gel& gel() const { return gel_; }

 private:
  Gel gel_;
  LayerTable table_;
  double scale_;  ///< 1 / (2 pi mu h)
  double per_thickness_;
};

/// Averages a layer's point field over one ellipse: half-space field + averaged correction up to some thicknesses, the
/// average of the whole field beyond, to about 1e-8 of the field.
class LayerEllipse {
 public:
  LayerEllipse(const Layer& layer, const substrate::Ellipse& ellipse);
  Sym2 compliance_um_per_nN(Vec2 point_um) const;

 private:
  const Layer& layer_;
  substrate::Ellipse ellipse_;
  HalfSpaceEllipse half_space_;
  std::vector<substrate::DiscPoint> correction_rule_;
  std::vector<substrate::DiscPoint> whole_rule_;
  double far_from_um_, whole_from_um_;
};

/// Displacement (um) of a half-space at `offset_um` from the centre of a square that carries 1 kPa:
///
///   g_xx = 1/(2 pi mu) [ (1-nu) x asinh(y/|x|) + y asinh(x/|y|) ],  g_xy = -nu r / (2 pi mu),  g_yy likewise,
///
/// each summed over the corners (x, y) as seen from the point, with alternating signs. Source: Cerruti's kernel (Landau
/// & Lifshitz, Theory of Elasticity, §8) integrated over the square; finite everywhere.
Sym2 square_compliance_um_per_kPa(const Gel& gel, double side_um, Vec2 offset_um);

/// The same on a layer: the base's part is smooth over a thickness, and averaged by 2 x 2 Gauss points.
Sym2 square_compliance_um_per_kPa(const Layer& layer, double side_um, Vec2 offset_um);

}  // namespace mbtfm::greens
