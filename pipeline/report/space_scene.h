/// The surface of a gel in space, as a picture.
#pragma once

#include <string>

#include "pipeline/report/colours.h"
#include "pipeline/report/space_results.h"

namespace mbtfm::report {

/// The traction at a place of the surface, between the vertices of its lattice.
class TractionOnSurface {
 public:
  /// @param tractions  on a lattice parallel to x and y, whole or in part
  TractionOnSurface(const std::vector<SurfaceTraction>& tractions, Vec2 spacing_um);
  /// Bilinear; none where a corner of the lattice's cell lacks.
  std::optional<Vec3> at(Vec2 place_um) const;

 private:
  int index(int column, int row) const;
  const std::vector<SurfaceTraction>& tractions_;
  Vec2 origin_um_, spacing_um_;
  int n_x_ = 0, n_y_ = 0;
  std::vector<int> vertex_;  ///< by place in the lattice; -1: none
};

/// The surface from a side and above, coloured by the size of the traction, with tractions as arrows: an SVG element.
/// Orthographic; the nearest parts are drawn last (the painter's order). No light: colours are those of the bar.
std::string picture_in_space(const SpaceResults& results, const ColourScale& colours);

}  // namespace mbtfm::report
