/// A constrained triangulation whose vertices move and whose free edges flip, without being rebuilt.
#pragma once

#include <array>
#include <span>
#include <vector>

#include "network/mesh/triangulation.h"

namespace mbtfm::mesh {

class MovingMesh {
 public:
  MovingMesh(std::vector<Vec2> points_um, const Triangulation& triangulation);

  const std::vector<Vec2>& points_um() const { return points_um_; }
  const std::vector<std::array<int, 3>>& triangles() const { return vertices_; }
  std::span<const int> triangles_of(int vertex) const {
    return {stars_.data() + star_begin_[vertex], stars_.data() + star_begin_[vertex + 1]};
  }

  /// The side of the triangle across from its i-th vertex belongs to the frame, or even bounds the cell.
  bool is_of_frame(int triangle, int i) const { return is_fixed_[triangle][i] != 0; }
  bool is_boundary(int triangle, int i) const { return neighbours_[triangle][i] < 0; }

  /// Move a vertex, if all its triangles keep their orientation and a part of their height.
  bool move(int vertex, Vec2 to_um);
  /// Flip free edges until the triangulation is constrained Delaunay again (Lawson 1977).
  /// @param moved  vertices since the last time
  /// @return vertices that got or lost an edge, some repeatedly
  std::vector<int> restore_delaunay(const std::vector<int>& moved);
  Triangulation triangulation() const;

 private:
  void join_neighbours(const Triangulation& triangulation);
  void index_stars();
  bool should_flip(int triangle, int side) const;
  void flip(int triangle, int side);
  void turn_neighbour(int triangle, int from, int to);

  std::vector<Vec2> points_um_;
  // by triangle; side i is across from vertex i
  std::vector<std::array<int, 3>> vertices_;
  std::vector<std::array<int, 3>> neighbours_;  ///< -1: the cell ends
  std::vector<std::array<char, 3>> is_fixed_;
  std::vector<int> star_begin_, stars_;
};

}  // namespace mbtfm::mesh
