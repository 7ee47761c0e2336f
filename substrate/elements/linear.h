/// Small strains: one solution.
#pragma once

#include <memory>

#include "pipeline/contract/gel.h"
#include "substrate/elements/space.h"

namespace mbtfm::elements {

/// What acts on a gel; empty: nothing.
struct Loading {
  OfSurface traction_kPa = {};
  OfPlace held_um = {};  ///< displacement of the nodes that are held
};

/// Displacement on a mesh.
struct Field {
  std::shared_ptr<const Block> block;
  std::shared_ptr<const Space> space;
  Vectors at_nodes_um;

  Eigen::Vector3d displacement_um(const Location& location) const;
  Eigen::Matrix3d gradient(const Location& location) const;  ///< [i][j] = d u_i / d x_j
};

/// By cell of a mesh, which must outlive it.
std::function<MatrixXd(int cell)> linear_stiffness_of(const substrate::Material& material, const Mesh& mesh);
/// The same of boxes. Similar ones of one modulus differ by length and modulus alone: each shape is computed once.
std::function<MatrixXd(int cell)> box_stiffness_of(const substrate::Material& material, const BlockMesh& mesh);

/// @throws NotSolved where memory would not suffice
Field solve_linear(const Gel& gel, std::shared_ptr<const Block> block, const Loading& loading,
                   const numerics::FactorOptions& options);

/// Layers from 0 to a depth, n of them, each 1.4 times as thick as the one above: of four, the error of a field at
/// depth is a third lower than of even ones (notes/accuracy.md).
std::vector<double> layers_um(double depth_um, int n);

}  // namespace mbtfm::elements
