/// Drawings for the report: SVG in the coordinates of the cell (um) inside a frame with axes.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pipeline/charts/chart.h"
#include "pipeline/contract/types.h"

namespace mbtfm::report {

using charts::html_escaped;
using charts::readable;
using charts::round_below;
using charts::ticks;

struct Box {
  Vec2 low, high;
};
Box box_of(const std::vector<Vec2>& points, double margin_um);

/// A map from numbers to colours that differ in lightness, so that colour-blind eyes and grey printers tell them apart.
struct ColourScale {
  double low = 0, high = 1;
  std::string label;  ///< with the unit
  std::string colour(double value) const;
};

/// End of a colour bar from zero that shows `value`: the next of the bar's ticks. 0 where nothing is positive.
double round_end(double value);

/// A map of the cell: x right, y down, both in um.
class MapDrawing {
 public:
  explicit MapDrawing(const Box& box_um);

  void polygon(const Polygon& corners_um, const std::string& style, const std::string& hover = {});
  void polyline(const Polyline& points_um, const std::string& style, const std::string& hover = {});
  /// Many separate pieces of line in one element.
  void pieces(const std::vector<std::pair<Vec2, Vec2>>& pieces_um, const std::string& style,
              const std::string& hover = {});
  void dot(Vec2 at_um, double radius_px, const std::string& style, const std::string& hover = {});
  /// An arrow that begins at `from_um` and is `length_px` long.
  void arrow(Vec2 from_um, Vec2 shift_px, const std::string& colour);
  /// A short text centred on a point, on a white rim.
  void label(Vec2 at_um, const std::string& text);
  void begin_group(const std::string& style);
  void end_group();

  /// What an arrow's length means: an arrow of `length_px` beside its text, below the map.
  void arrow_legend(double length_px, const std::string& text);
  void colour_bar(const ColourScale& scale);

  /// Axes, scale bar and legends added, as one <svg> element.
  std::string str(const std::string& description) const;
  double px_per_um() const { return px_per_um_; }
  static constexpr double kWidth_px = 560;  ///< of the drawing; browsers scale it to the column

 private:
  std::string point(Vec2 at_um) const;
  double x(double x_um) const;
  double y(double y_um) const;
  Box box_um_;
  double px_per_um_ = 1;
  double height_px_ = 0;  ///< of the map
  std::string body_, legend_;
  double legends_px_ = 0;  ///< height of those added so far
};

}  // namespace mbtfm::report
