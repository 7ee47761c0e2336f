/// Quadratic displacements on a mesh of hexahedra, straight or bent: the equations over it, where it is asked.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "pipeline/numerics/cholesky.h"
#include "substrate/elements/free_nodes.h"
#include "substrate/elements/mesh.h"

namespace mbtfm::elements {

using Vectors = std::vector<Eigen::Vector3d>;

/// By place in the gel: a displacement (um), a force per volume (kPa/um).
using OfPlace = std::function<Eigen::Vector3d(const Eigen::Vector3d& position_um)>;
/// A traction (kPa) by place on the surface and outward normal.
using OfSurface = std::function<Eigen::Vector3d(const Eigen::Vector3d& position_um, const Eigen::Vector3d& normal)>;

class Space {
 public:
  Space(const Mesh& mesh, int threads);

  const Mesh& mesh() const { return mesh_; }
  const FreeNodes& nodes() const { return nodes_; }
  int threads() const { return threads_; }
  int n_unknowns() const { return 3 * nodes_.size(); }

  /// The factor of the matrix over the free nodes. `stiffness_of` is called concurrently, `add_held` takes what belongs
  /// to nodes held. Any matrix over the nodes has the same order of elimination, which is looked for once.
  /// @throws NotSolved where memory would not suffice
  std::shared_ptr<const numerics::SparseCholesky> factorise(const std::function<MatrixXd(int cell)>& stiffness_of,
                                                            const numerics::FactorOptions& options,
                                                            const FreeNodes::AddHeld& add_held = {}) const;
  /// Forces on the free nodes, by cell and node of it; called concurrently.
  Vectors gather(const std::function<NodeValues(int cell)>& forces_of) const;
  /// Consistent forces (nN) of a traction on the surface.
  Vectors traction_forces_nN(const OfSurface& traction_kPa) const;

  /// Displacements of all nodes from those of the free ones, with those of the nodes held; null: these are 0.
  Vectors spread(const Vectors& free_um, const OfPlace& held_um = {}) const;
  /// Of all nodes, those of the free ones.
  Vectors of_free_nodes(const Vectors& at_nodes) const;
  NodeValues values_of(int cell, const Vectors& at_nodes) const;

  /// The value at a place, as weights of free nodes.
  std::vector<NodeWeight> weights_at(const Location& location) const;

 private:
  Mesh mesh_;
  int threads_;
  FreeNodes nodes_;
  struct Order {
    std::once_flag is_found;
    std::shared_ptr<const numerics::Elimination> elimination;
  };
  std::shared_ptr<Order> order_ = std::make_shared<Order>();
};

/// Gauss points of the outer face of a cell, n each way.
struct FaceRulePoint {
  FacePoint at;
  Shapes shapes;
  double weight = 0;  ///< share of the unit square
};
std::vector<FaceRulePoint> face_rule(const NodePositions& nodes_um, int n);

/// One column, by free node.
Vectors solve(const numerics::SparseCholesky& factor, const Vectors& forces_nN);

}  // namespace mbtfm::elements
