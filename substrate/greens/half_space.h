/// The elastic half-space under tangential forces on its surface (Cerruti).
#pragma once

#include <array>

#include "pipeline/contract/gel.h"
#include "substrate/ellipse.h"

namespace mbtfm::greens {

/// A symmetric 2 x 2 matrix.
struct Sym2 {
  double xx = 0, xy = 0, yy = 0;
};
inline Sym2& operator+=(Sym2& a, const Sym2& b) {
  a.xx += b.xx;
  a.xy += b.xy;
  a.yy += b.yy;
  return a;
}
inline Sym2 operator-(const Sym2& a, const Sym2& b) { return {a.xx - b.xx, a.xy - b.xy, a.yy - b.yy}; }
inline Sym2 operator*(double s, const Sym2& a) { return {s * a.xx, s * a.xy, s * a.yy}; }
inline Vec2 operator*(const Sym2& a, Vec2 v) { return {a.xx * v.x + a.xy * v.y, a.xy * v.x + a.yy * v.y}; }

/// Moments of the chords of an ellipse through a point, c(t) being the length of the chord in direction e(t):
///
///   M = integral over the directions t in [0, pi) of c(t) e e^T dt      (um)
///
/// In the ellipse's own frame (x along the major axis). To about 1e-12 of the trace, on the rim and for slender
/// ellipses too. Source: polar coordinates about the observer, dA = s ds dt, cancel the 1/s of Cerruti's kernel.
Sym2 chord_moments_um(Vec2 point_um, double semi_major_um, double semi_minor_um);

/// Displacement (um) of points of the surface by a unit force (1 nN) spread evenly over an ellipse; the half-space's
/// exact field, inside and outside:
///
///   g = 1 / (2 pi mu A) [ (1-nu) tr(M) I + nu M ],   A the ellipse's area, M its chord moments at the point
///
/// Source: Landau & Lifshitz, Theory of Elasticity, §8, integrated.
class HalfSpaceEllipse {
 public:
  HalfSpaceEllipse(const Gel& gel, const substrate::Ellipse& ellipse);
  Sym2 compliance_um_per_nN(Vec2 point_um) const;
  /// The same up to the fourth order of a/r, a the larger semi-axis: off by (a/r)^6 / 10 of it, at a tenth of the cost.
  Sym2 far_compliance_um_per_nN(Vec2 point_um) const;

 private:
  substrate::Ellipse ellipse_;
  double poisson_ratio_, cos_, sin_;
  double scale_;  ///< 1 / (2 pi mu A)
  /// Means over the ellipse of w^j conj(w)^k, w = x + i y in its frame; the odd ones vanish.
  double m20_, m11_, m40_, m31_, m22_;
};

/// Displacement (um) of points of the surface into the half-space, by forces spread evenly over ellipses; exact:
///
///   w = (1 - 2 nu) / (4 pi mu A) F . I,   I = integral of r / |r|² over the ellipse
///
/// With z = x + i y in the ellipse's frame, I_x - i I_y is pi (conj(z) - z (a-b)/(a+b)) inside it and
/// 2 pi a b / (z + sqrt(z² - a² + b²)) outside. Source: Johnson (1985), eq. 3.75c at z = 0; the field of an even
/// elliptic cylinder of charge.
std::vector<double> half_space_vertical_um(const Gel& gel, const std::vector<Vec2>& points_um,
                                           const std::vector<substrate::Ellipse>& ellipses,
                                           const std::vector<Vec2>& forces_nN, int threads);

/// Displacement of the half-space below its surface by unit point forces at the origin of its surface.
/// Index [f]: force along x (0) or y (1).
struct PointForceField {
  std::array<std::array<double, 3>, 2> u_um_per_nN{};
  std::array<std::array<std::array<double, 3>, 3>, 2> gradient_per_nN{};  ///< [f][i][j] = d u_i / d x_j
};
/// @param z_um  depth, >= 0; x, y, z not all zero
/// Source: Johnson, Contact Mechanics (1985), eq. 3.75.
PointForceField cerruti_field(const Gel& gel, double x_um, double y_um, double z_um);

}  // namespace mbtfm::greens
