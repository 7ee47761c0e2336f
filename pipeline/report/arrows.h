/// Fields of arrows on the report's maps.
#pragma once

#include <string>
#include <vector>

#include "pipeline/charts/chart.h"

namespace mbtfm::report {

/// A part of the plane.
struct Box {
  Vec2 low, high;
};

/// Vectors at points, to be drawn as arrows.
struct VectorField {
  std::vector<Vec2> positions_um, vectors = {};
};

/// Means over square cells that hold at least three points.
struct AveragedField {
  VectorField means = {};
  double side_um = 0;       ///< of the squares
  double mean_members = 0;  ///< points a square
};

/// Side of the squares over which to average: as small as arrows can be told apart, larger where they would hold too
/// few points for noise to fade.
double averaging_side_um(const VectorField& field, const Box& box);

AveragedField averaged(const VectorField& field, const Box& box, double side_um);

/// How long an arrow is; shared by maps that are to be compared.
struct ArrowScale {
  double top = 0;  ///< length of the longest arrows and end of the colours, in the field's unit
  double px_per_unit = 0;
};
/// Of no length where nothing moves.
ArrowScale arrow_scale(const std::vector<Vec2>& vectors);

/// Draw a field, each arrow in the colour of its length. @param what  named in the colour bar
/// @returns the legend as HTML: an arrow and a colour bar
std::string draw_arrows(charts::Chart& map, const VectorField& field, const ArrowScale& scale, const std::string& what,
                        const std::string& unit);
/// What an arrow's length means, as HTML.
std::string arrow_legend(const ArrowScale& scale, const std::string& unit);

}  // namespace mbtfm::report
