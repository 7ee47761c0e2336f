/// Tensions between the points where elements have them best, and fields at any point.
#pragma once

#include <optional>
#include <vector>

#include "continuum/sheet/sheet.h"

namespace mbtfm::sheet {

/// Values at the nodes: around each corner a quadratic polynomial through the points of the triangles around it by
/// least squares; between corners the mean of theirs. Of derivatives of quadratic elements, an order more than these
/// have themselves. Source: Zienkiewicz & Zhu, Int. J. Numer. Methods Eng. 33 (1992) 1331.
/// @param at_points  kPoints for each triangle
std::vector<Tensor> recovered(const Elements& elements, const std::vector<Tensor>& at_points);

/// What is known of S beside the values of the elements.
struct KnownOfTension {
  std::vector<Vec2> divergence_kPa;  ///< T at each point of the elements
  double line_tension_nN = 0;
  int n_rims = 1;
  std::vector<char> is_free;                    ///< by side of the triangles: S n = Λ dt/ds there
  std::vector<std::optional<Tensor>> at_nodes;  ///< of free rims: along them S follows from u, which is closer
};
/// The same, where polynomials that break the balance pay for it, too: several times closer at the edge. Source: Wiberg
/// & Abdulwahab, Int. J. Numer. Methods Eng. 36 (1993) 2703.
std::vector<Tensor> recovered(const Elements& elements, const std::vector<Tensor>& at_points,
                              const KnownOfTension& known);
/// Of a sheet on springs at small strain.
KnownOfTension known_on_springs(const Elements& elements, const Sheet& sheet, const NodeVectors& u);

/// |recovered − own| / |recovered|, of tensions over the whole sheet: about the relative error of the own ones.
double relative_error(const Elements& elements, const std::vector<Tensor>& at_points,
                      const std::vector<Tensor>& at_nodes);

/// ∫ over the sheet / its area.
Tensor mean_over(const Elements& elements, const std::vector<Tensor>& at_points);

/// A field of the nodes at a place.
Tensor value_of(const std::vector<Tensor>& at_nodes, const std::array<int, 6>& nodes, const Shape& shape);

}  // namespace mbtfm::sheet
