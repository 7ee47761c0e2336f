/// The stiffness of a sheet's nodes, and what its triangles add to it.
#pragma once

#include <vector>

#include "continuum/sheet/sheet.h"
#include "pipeline/numerics/held_matrix.h"

namespace mbtfm::sheet {

struct Stiffness : numerics::HeldMatrix<2> {
  using OfElement = Eigen::Matrix<double, 12, 12>;

  /// @param held  by node, along x and y: these do not move; empty: none
  Stiffness(const Elements& elements, std::vector<std::array<bool, 2>> held);
};

/// ∫ Bᵀ C B of a triangle at rest.
Stiffness::OfElement elastic_stiffness(const Elements& elements, int triangle, const Material& material);
/// ∫ κ N N. @param by_point  kPoints values
Stiffness::OfElement spring_stiffness(const Elements& elements, int triangle, const double* by_point);

/// Three components that keep a free sheet from moving as a whole: both of a node, and the one across to it of the node
/// furthest away. Balanced forces leave them without a reaction.
std::vector<std::array<bool, 2>> pins(const Elements& elements);

}  // namespace mbtfm::sheet
