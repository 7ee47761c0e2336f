/// Quadratic displacements on a mesh of bent hexahedra: the equations over it, what loads it, where it is asked.
#pragma once

#include <functional>
#include <memory>
#include <mutex>
#include <vector>

#include "pipeline/numerics/cholesky.h"
#include "substrate/boxes/free_nodes.h"
#include "substrate/curved/mesh.h"

namespace mbtfm::curved {

using Vectors = std::vector<Eigen::Vector3d>;

/// By place in the gel: a displacement (um), a force per volume (kPa/um).
using OfPlace = std::function<Eigen::Vector3d(const Eigen::Vector3d& position_um)>;
/// A traction (kPa) by place on the surface and outward normal.
using OfSurface = std::function<Eigen::Vector3d(const Eigen::Vector3d& position_um, const Eigen::Vector3d& normal)>;

class Space {
 public:
  Space(const Mesh& mesh, int threads);

  const Mesh& mesh() const { return mesh_; }
  const boxes::FreeNodes& nodes() const { return nodes_; }
  int threads() const { return threads_; }
  int n_unknowns() const { return 3 * nodes_.size(); }

  /// The matrix over the free nodes. `stiffness_of` is called concurrently.
  numerics::BlockMatrix<3> assemble(const std::function<MatrixXd(int cell)>& stiffness_of) const;
  /// Its factor. Any matrix over the nodes has the same order of elimination, which is looked for once.
  std::shared_ptr<const numerics::SparseCholesky> factorise(const std::function<MatrixXd(int cell)>& stiffness_of,
                                                            const numerics::FactorOptions& options) const;
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
  std::vector<boxes::NodeWeight> weights_at(const Location& location) const;

 private:
  Mesh mesh_;
  int threads_;
  boxes::FreeNodes nodes_;
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

}  // namespace mbtfm::curved
