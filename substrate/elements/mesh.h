/// Meshes of bent hexahedra: the block of a gel under a curved surface, and what every such mesh has.
#pragma once

#include <array>
#include <functional>
#include <vector>

#include "substrate/elements/block_mesh.h"
#include "substrate/elements/element.h"

namespace mbtfm::elements {

struct Mesh {
  std::vector<int> cell_nodes;                   ///< kNodes a cell; the face z = 0 of a cell is its outer one
  std::vector<Eigen::Vector3d> position_um;      ///< by node
  std::vector<std::vector<NodeWeight>> hanging;  ///< by node: what it hangs on, in position, too; empty: nothing
  std::vector<char> is_held;                     ///< by node: its displacement is given
  std::vector<int> surface_cells;                ///< those whose outer face carries tractions

  int n_cells() const { return static_cast<int>(cell_nodes.size()) / kNodes; }
  const int* nodes_of(int cell) const { return &cell_nodes[static_cast<std::size_t>(cell) * kNodes]; }
  NodePositions positions_of(int cell) const;
};

/// Of an element, at its worst corner: 1 of a box, the cosine of the angle by which a slanted one leans.
constexpr double kLeastScaledJacobian = 0.1;

/// A gel on a plane base, z = base_um, under its surface z = height_um(x, y); z points into the gel.
struct Shape {
  std::function<double(Vec2)> height_um;
  double base_um = 0;
};

inline Shape flat(double thickness_um) {
  return {[](Vec2) { return 0.0; }, thickness_um};
}

/// @throws InvalidData where the point lies above the surface or below the base
void check_inside(const Shape& shape, const Vec3& point_um);

enum class Sides { free, held };

/// Where a point lies: in which cell, and where in it.
struct Location {
  int cell = 0;
  Eigen::Vector3d unit;
};

/// The part of a gel over a rectangle: a block of boxes [x] × [y] × [0, depth] whose lines along z are pulled, each
/// evenly, onto the surface. x and y stay as they are, so that any height field gives a mesh that is not turned over.
class Block {
 public:
  /// @param lines         of the block before it is pulled, its depth that of the gel in the mean
  /// @param is_too_large  of its boxes: see make_block_mesh
  /// @throws InvalidData where a cell is bent so much that its scaled Jacobian falls below 0.1, by place; NotSolved
  ///         where the cells grow beyond `most_cells`
  Block(Shape shape, const GridLines& lines, const std::function<bool(const Box&)>& is_too_large, Sides sides,
        std::int64_t most_cells, int threads);

  const Mesh& mesh() const { return mesh_; }
  const BlockMesh& boxes() const { return boxes_; }
  const Shape& shape() const { return shape_; }
  /// A place of the surface, seen from above. @throws InvalidData where it lies outside the block
  Location on_surface(Vec2 point_um) const;
  /// @throws InvalidData where the point lies outside the block, above its surface or below its base
  Location locate(const Vec3& point_um) const;

 private:
  Shape shape_;
  BlockMesh boxes_;
  Mesh mesh_;
};

}  // namespace mbtfm::elements
