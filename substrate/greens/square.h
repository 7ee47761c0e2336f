/// Square elements of the surface that carry an even traction.
#pragma once

#include "substrate/greens/half_space.h"
#include "substrate/greens/layer.h"

namespace mbtfm::greens {

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
