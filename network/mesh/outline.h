/// The cell's outline and the rims of its holes as smooth closed curves: pixel steps averaged away, sharp corners kept.
#pragma once

#include <utility>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"
#include "pipeline/numerics/neighbour_bins.h"

namespace mbtfm::mesh {

class OutlineCurve {
 public:
  /// Averages the outline over half an edge length, so that steps finer than that vanish while the curve keeps its
  /// place (a circle of radius R shrinks by edge² / (96 R)); a turn by more than 50° within an edge is a corner.
  OutlineCurve(const Polygon& outline_um, double edge_um);

  double length_um() const { return start_um_.back(); }
  Vec2 at(double s_um) const;
  /// The point of a piece of the polygon nearest to `point_um`.
  struct Nearest {
    double s_um = 0;
    double distance_um = 0;
  };
  Nearest nearest_on_piece(std::size_t piece, Vec2 point_um) const;
  /// Arc lengths of the corners, rising.
  const std::vector<double>& corners() const { return corners_um_; }
  const Polygon& polygon() const { return points_um_; }
  bool contains(Vec2 point_um) const;
  /// Brings an arc length into [0, length).
  double wrapped(double s_um) const;

 private:
  void index_stripes();
  int stripe_of(double y_um) const;

  Polygon points_um_;             ///< positively oriented
  std::vector<double> start_um_;  ///< arc length at each point, and the whole length at the end
  std::vector<double> corners_um_;
  // which pieces cross a horizontal stripe
  double top_um_ = 0;
  double stripe_um_ = 1;
  std::vector<std::vector<int>> stripes_;
};

/// A point seen from the boundary.
struct BoundaryPlace {
  int ring = 0;             ///< the nearest
  double s_um = 0;          ///< where on it
  double distance_um = 0;   ///< infinite where the point is inside and further than an edge length from it
  bool is_inside = true;    ///< the cell
  bool is_in_hole = false;  ///< outside the cell, but inside its outline
};

/// The outline and the holes that a mesh can show: those smaller than one of its triangles are filled.
class Boundary {
 public:
  Boundary(const Cell& cell, double edge_um);

  const std::vector<OutlineCurve>& rings() const { return rings_; }  ///< the outline, then the holes
  int n_filled_holes() const { return n_filled_holes_; }
  bool is_within_outline(Vec2 point_um) const { return rings_.front().contains(point_um); }
  BoundaryPlace place(Vec2 point_um) const;

 private:
  double edge_um_;
  std::vector<OutlineCurve> rings_;
  int n_filled_holes_ = 0;
  std::vector<std::pair<int, int>> pieces_;  ///< ring and place in it
  numerics::Grid grid_{{}, 1};               ///< of the pieces
};

}  // namespace mbtfm::mesh
