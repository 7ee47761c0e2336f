/// The wanted edge length as a function of place: fine where something needs it, and growing from there.
#pragma once

#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm::mesh {

/// h(x) = min(edge, min over sources of size + growth · |x − source|): distmesh's fh. It is Lipschitz with the growth,
/// so that neighbouring edges differ little in length.
class SizeField {
 public:
  /// @param around_um  points whose box (and a margin) is where sizes will be asked for most
  SizeField(double edge_um, double growth, const std::vector<Vec2>& around_um);

  /// Edges of `size_um` at `point_um`; of no effect where the field is that small already.
  void refine(Vec2 point_um, double size_um);
  double at(Vec2 point_um) const;
  double edge_um() const { return edge_um_; }

 private:
  struct Source {
    Vec2 point_um;
    double size_um = 0;
  };
  struct Bin {
    std::vector<Source> sources{};  ///< that are smallest somewhere in the bin
    double bound_um = 0;            ///< the field is nowhere larger in the bin
  };
  Vec2 centre_of(int column, int row) const;
  int column_of(double x_um) const;
  int row_of(double y_um) const;

  double edge_um_;
  double growth_;
  double bin_um_;
  Vec2 low_um_;
  int columns_ = 1;
  int rows_ = 1;
  std::vector<Bin> bins_;
};

}  // namespace mbtfm::mesh
