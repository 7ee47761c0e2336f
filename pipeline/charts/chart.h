/// Charts of curves and points as SVG, for every program that draws one.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "pipeline/contract/types.h"

namespace mbtfm::charts {

std::string html_escaped(std::string_view text);
/// Three significant digits, for people.
std::string readable(double value);
/// Round number (1, 2 or 5 times a power of ten) nearest below. @param value  > 0
double round_below(double value);
/// Multiples of the smallest step of 1, 2 or 5 times a power of ten that gives no more than six of them.
std::vector<double> ticks(double low, double high);

/// Colours that differ in lightness and to colour-blind eyes (Okabe & Ito 2008), for curves in turn.
inline constexpr const char* kColours[] = {"#0072B2", "#D55E00", "#00805C", "#B87A00", "#8E4A7E", "#333333"};

enum class Scale { linear, logarithmic };

struct Axis {
  std::string label;  ///< with the unit
  double low = 0, high = 1;
  Scale scale = Scale::linear;
};
/// That holds all finite values (positive ones if logarithmic) and some room on both sides.
Axis axis_over(std::string label, const std::vector<double>& values, Scale scale);

/// One frame with two axes. What reaches beyond the frame is cut off.
class Chart {
 public:
  Chart(std::string title, Axis x, Axis y);

  /// A line below the title.
  void subtitle(std::string text, std::string colour);
  /// The x axis in another unit, along the upper side: its value is `factor` times that of the lower.
  void second_x_axis(std::string label, double factor);
  void curve(const std::vector<Vec2>& points, const std::string& style);
  void dot(Vec2 at, double radius_px, const std::string& style, const std::string& hover = {});
  /// A word beside a point.
  void label(Vec2 at, const std::string& text, const std::string& colour);
  /// A line across the frame at x, or at y.
  void upright(double x, const std::string& style);
  void level(double y, const std::string& style);
  /// A line of the key, in the frame's upper corner on the given side.
  void key(const std::string& text, const std::string& colour);
  enum class KeySide { left, right };
  void put_key(KeySide side) { key_side_ = side; }

  static constexpr double kWidth_px = 460, kHeight_px = 370;
  std::string str() const;  ///< its elements, from (0, 0) to the width and height

 private:
  Vec2 place(Vec2 value) const;
  std::string title_, subtitle_, subtitle_colour_, second_label_, body_;
  Axis x_, y_;
  double second_factor_ = 0;  ///< 0: no second axis
  std::vector<std::pair<std::string, std::string>> keys_;
  KeySide key_side_ = KeySide::right;
};

/// Charts beside each other in rows, with lines of text below, as a file of its own.
std::string svg_file(const std::vector<Chart>& charts, int n_columns, const std::vector<std::string>& caption);

}  // namespace mbtfm::charts
