/// What the report's maps share: frames, colours that represent numbers, fields of arrows.
#pragma once

#include <string>
#include <vector>

#include "pipeline/charts/chart.h"
#include "pipeline/contract/beads.h"
#include "pipeline/contract/extent.h"

namespace mbtfm::report {

/// x to the right, y down, both in um.
charts::Chart empty_map(const Extent& box, const std::string& title);

/// A map from numbers to colours that differ in lightness, also for colour-blind eyes and grey printers.
struct ColourScale {
  double low = 0, high = 1;
  std::string label;  ///< with the unit
  std::string colour(double value) const;
};

/// End of a colour bar from zero that shows `value`: the next of the bar's ticks. 0 where nothing is positive.
double round_end(double value);

/// The scale as HTML; nothing where it has no width.
std::string colour_bar(const ColourScale& scale);
/// What goes below a chart to explain it, as HTML.
std::string legend(const std::string& items);

/// Vectors at points, to be drawn as arrows.
struct VectorField {
  std::vector<Vec2> positions_um, vectors = {};
};

/// The displacement of the beads that are not flagged.
VectorField displacement_of(const DisplacementField& beads);

/// Means over square cells that hold at least three points.
struct AveragedField {
  VectorField means = {};
  double mean_members = 0;  ///< points a square
};

/// Side of the squares over which to average: as small as arrows can be distinguished, larger where they would hold too
/// few points for noise to fade.
double averaging_side_um(const VectorField& field, const Extent& box);

AveragedField averaged(const VectorField& field, const Extent& box, double side_um);

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
/// Squares around the points, in the colours of the vectors' lengths, as the address of a picture of a few dozen
/// colours: some ten thousand marks of their own would make the page slow.
std::string picture_of_squares(const VectorField& field, double side_um, const Extent& box, const ColourScale& colours);
/// What an arrow's length means, as HTML.
std::string arrow_legend(const ArrowScale& scale, const std::string& unit);

}  // namespace mbtfm::report
