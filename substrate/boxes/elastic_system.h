/// The finite element equations of a block on a rigid base: u = given on the bottom, forces on the surface and sides.
///
///   2 mu (eps u, eps v) + lambda (P div u, P div v) = load(v)
///
/// P projects onto the linear functions of each element (Q2-P1disc) or its constants (Q1-P0): the pressure of a mixed
/// method, eliminated element by element. So the matrix stays positive definite, and nothing locks as nu -> 1/2.
/// Source: Boffi, Brezzi, Fortin, Mixed Finite Element Methods (2013), §8.6 and 8.8.
#pragma once

#include <Eigen/SparseCore>

#include "pipeline/numerics/cholesky.h"
#include "substrate/boxes/block_mesh.h"
#include "substrate/boxes/free_nodes.h"
#include "substrate/compliance.h"
#include "substrate/ellipse.h"
#include "substrate/material.h"

namespace mbtfm::boxes {

class ElasticSystem {
 public:
  /// @throws NotSolved where memory would not suffice
  ElasticSystem(const substrate::Material& material, BlockMesh mesh, const numerics::FactorOptions& options);

  const BlockMesh& mesh() const { return mesh_; }
  const numerics::SparseCholesky& factor() const { return factor_; }
  int n_unknowns() const { return 3 * nodes_.size(); }

  /// The load of an ellipse on the free nodes: the share of the force that each takes.
  /// @throws InvalidData where a part of it lies outside the block
  std::vector<NodeWeight> load_weights(const substrate::Ellipse& ellipse) const;
  /// The displacement of a point of the surface as a mean over free nodes. @throws InvalidData outside the block
  std::vector<NodeWeight> surface_weights(Vec2 point_um) const;
  /// Shape functions of a cell at a point of it given in [0, 1]³, gathered on the free nodes.
  std::vector<NodeWeight> cell_weights(int cell, std::array<double, 3> unit) const;

  /// Nodes on the bottom, in the order of the columns of bottom_stiffness(), three each.
  const std::vector<int>& bottom_nodes() const { return nodes_.held(); }
  /// Rows: free unknowns.
  const Eigen::SparseMatrix<double>& bottom_stiffness() const { return bottom_stiffness_; }
  /// The solution at every node of the mesh, free or not.
  std::vector<std::array<double, 3>> at_all_nodes(const numerics::NodalColumn& u) const;
  /// Elements of the surface that an ellipse touches.
  std::vector<int> touched_cells(const substrate::Ellipse& ellipse) const;

 private:
  numerics::BlockMatrix<3> assemble(const substrate::Material& material);

  BlockMesh mesh_;
  FreeNodes nodes_;  ///< those on the bottom are held
  Eigen::SparseMatrix<double> bottom_stiffness_;
  numerics::SparseCholesky factor_;
};

/// Stiffness of one box of order 1 or 2, (3 nodes)² by columns; unknown 3 k + i is axis i of node k, x fastest.
MatrixXd box_stiffness(const substrate::Material& material, int order, const Box& box);

/// A solution inside the gel, as boxes with values. @param with_stress  mean over each box
substrate::VolumeField volume_field(const ElasticSystem& system, const substrate::Material& material,
                                    const numerics::NodalColumn& u, bool with_stress);

/// What `memory_limit_GB` stands for: 0 is four fifths of the machine's memory.
double allowed_GB(double memory_limit_GB);

}  // namespace mbtfm::boxes
