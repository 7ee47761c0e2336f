/// The equilibrium of a contracting body on a mesh.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "continuum/solids/mesh.h"
#include "pipeline/numerics/held_matrix.h"

namespace mbtfm::solids {

/// Which of its displacements a node is denied.
struct Held {
  bool along_r = false, along_z = false;
};

/// The unknowns of a mesh: which are held, and in which order they are eliminated. It serves all meshes that are cut
/// the same way.
struct Unknowns : numerics::HeldMatrix<2> {
  /// @param held  by place; on the axis r is held without being said
  Unknowns(const Mesh& mesh, const std::function<solids::Held(Vec2 place_um)>& held);
};

struct Body {
  std::shared_ptr<const Mesh> mesh;
  std::shared_ptr<const Unknowns> unknowns;
  std::vector<Solid> solids;  ///< by part
};

struct Deformed {
  Body body;
  Strain strain = Strain::small;
  std::vector<Vec2> displacement_um = {};  ///< by node
  double energy_fJ = 0;                    ///< elastic, with what the contraction gains: below zero
  int iterations = 1;                      ///< of Newton's method

  Nodes displacement_of(int element) const;
  Vec2 displacement_um_at(const Mesh::Place& place) const;
  Eigen::Vector4d stress_kPa_at(const Mesh::Place& place) const;  ///< rr, tt, zz, rz
  /// Forces of a part's elements on the nodes, or of all (-1): nN around the axis.
  std::vector<Vec2> forces_nN(int part = -1) const;
};

/// Small strains: one solution. Large ones: Newton's method on steps of the contraction.
/// @throws NotSolved where the matrix is not positive definite (an element turned over, or the body buckles)
Deformed solve(const Body& body, Strain strain);

}  // namespace mbtfm::solids
