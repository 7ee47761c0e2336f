/// Charts of curves and points: described and drawn once, as SVG, for files and for pages, where they zoom and answer
/// the mouse (pipeline/report/page.js).
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"

namespace mbtfm::charts {

std::string html_escaped(std::string_view text);
/// Three significant digits, for people.
std::string readable(double value);
/// Round number (1, 2 or 5 times a power of ten) nearest below. @param value  > 0
double round_below(double value);
/// Multiples of the smallest step of 1, 2 or 5 times a power of ten that gives no more than six of them; none where
/// high <= low or either is not finite.
std::vector<double> ticks(double low, double high);

/// Colours that differ in lightness and to colour-blind eyes (Okabe & Ito 2008), for curves in turn.
inline constexpr const char* kColours[] = {"#0072B2", "#D55E00", "#00805C", "#B87A00",
                                           "#8E4A7E", "#333333", "#4A9CC9", "#8A8A00"};

/// Of the fibres' types, in every chart and page.
constexpr const char* colour_of(FibreType type) {
  constexpr const char* kOfType[] = {"#0072B2", "#B87A00", "#00805C", "#B5482A", "#6E6E6E"};  // as kFibreTypes
  return kOfType[static_cast<int>(type)];
}

/// The colour "#rrggbb" as dark as text on white must be for weak eyes: with a contrast of 4.5 (WCAG 2.1, 1.4.3).
/// Other ways to write a colour come back as they are.
std::string readable_on_white(const std::string& colour);
double contrast_to_white(const std::string& colour);

enum class Scale { linear, logarithmic };

struct Axis {
  std::string label;         ///< with the unit
  double low = 0, high = 1;  ///< a linear axis may run downwards: low > high
  Scale scale = Scale::linear;
  /// Ticks with names, for groups in a row, in place of numbers.
  std::vector<std::pair<double, std::string>> names = {};
};
/// Of rows with names from the top down, at 0, 1, 2, …, for a y axis.
Axis row_axis(const std::vector<std::string>& names);
/// That holds all finite values (positive ones if logarithmic) and some room on both sides.
Axis axis_over(std::string label, const std::vector<double>& values, Scale scale);
/// Where a value lies between the ends of its axis, 0 to 1; NaN where it has no place.
double share(const Axis& axis, double value);

/// Something drawn in the frame. `style` is CSS of SVG: fill, stroke, stroke-width, stroke-dasharray, ….
struct Mark {
  enum class Kind {
    curve,    ///< through `points`
    polygon,  ///< with corners `points`
    pieces,   ///< of line, between each two of `points`
    bar,      ///< a rectangle between two opposite corners
    error,    ///< a line between two points with a stop at each end
    dot,
    diamond,
    arrow,    ///< from a point, by `shift_px`
    upright,  ///< across the frame at x
    level,    ///< across the frame at y
    label,    ///< `text` centred on a point, on a white rim
    picture   ///< between two opposite corners: the image whose address is `text`
  };
  Kind kind = Kind::dot;
  std::vector<Vec2> points = {};  ///< in the units of the axes
  std::string style = {};
  std::string hover = {};  ///< what one reads where the mouse rests on it
  std::string text = {};   ///< of a bar: its class in the page's style sheet
  double radius_px = 0;    ///< of a dot or diamond
  Vec2 shift_px = {};      ///< of an arrow, in a frame of the SVG's width; in pages it grows with the frame
};

/// One frame with two axes. What reaches beyond the frame is cut off. An axis whose ends are equal or not finite gets
/// some other end.
class Chart {
 public:
  Chart(std::string title, Axis x, Axis y);

  /// A line below the title.
  void subtitle(std::string text, std::string colour) {
    subtitle_ = std::move(text);
    subtitle_colour_ = std::move(colour);
  }
  /// The x axis in another unit, along the upper side: its value is `factor` times that of the lower.
  void second_x_axis(std::string label, double factor) {
    second_label_ = std::move(label);
    second_factor_ = factor;
  }
  /// Height of the frame, where the usual one does not suit.
  void frame_height(double height_px) { frame_height_px_ = height_px; }
  /// A unit of x is as long as one of y: a map.
  void same_scales() { are_scales_same_ = true; }

  void curve(const std::vector<Vec2>& points, const std::string& style, const std::string& hover = {}) {
    marks_.push_back({Mark::Kind::curve, points, style, hover});
  }
  void polygon(const std::vector<Vec2>& corners, const std::string& style, const std::string& hover = {}) {
    marks_.push_back({Mark::Kind::polygon, corners, style, hover});
  }
  /// Separate pieces of line, as one thing.
  void pieces(const std::vector<std::pair<Vec2, Vec2>>& pieces, const std::string& style,
              const std::string& hover = {});
  /// A filled rectangle between two opposite corners.
  void bar(Vec2 corner, Vec2 opposite, const std::string& style, const std::string& hover = {}) {
    marks_.push_back({Mark::Kind::bar, {corner, opposite}, style, hover});
  }
  /// Two colours over a picture in turn: of a picture in two colours each shows one part.
  void blink(Vec2 corner, Vec2 opposite, const char* first, const char* second) {
    marks_.push_back({Mark::Kind::bar, {corner, opposite}, std::string("fill:") + first, {}, "blink"});
    marks_.push_back({Mark::Kind::bar, {corner, opposite}, std::string("fill:") + second, {}, "blink late"});
  }
  /// An error bar, along x or y.
  void error(Vec2 from, Vec2 to, const std::string& style, const std::string& hover = {}) {
    marks_.push_back({Mark::Kind::error, {from, to}, style, hover});
  }
  void dot(Vec2 at, double radius_px, const std::string& style, const std::string& hover = {}) {
    marks_.push_back({Mark::Kind::dot, {at}, style, hover, {}, radius_px});
  }
  void diamond(Vec2 at, double radius_px, const std::string& style, const std::string& hover = {}) {
    marks_.push_back({Mark::Kind::diamond, {at}, style, hover, {}, radius_px});
  }
  void arrow(Vec2 from, Vec2 shift_px, const std::string& style) {
    marks_.push_back({.kind = Mark::Kind::arrow, .points = {from}, .style = style, .shift_px = shift_px});
  }
  /// A line across the frame at x, or at y.
  void upright(double x, const std::string& style) { marks_.push_back({Mark::Kind::upright, {{x, y_.low}}, style}); }
  void level(double y, const std::string& style) { marks_.push_back({Mark::Kind::level, {{x_.low, y}}, style}); }
  void label(Vec2 at, const std::string& text) { marks_.push_back({Mark::Kind::label, {at}, {}, {}, text}); }
  /// @param address  "data:image/…" if a page must be self-contained
  void picture(Vec2 corner, Vec2 opposite, const std::string& address) {
    marks_.push_back({Mark::Kind::picture, {corner, opposite}, {}, {}, address});
  }
  /// A line of the key, in the frame's upper corner on the given side.
  void key(const std::string& text, const std::string& colour) { keys_.emplace_back(text, colour); }
  enum class KeySide { left, right, above };  ///< above: in a row over the frame, off what a map shows
  void put_key(KeySide side) { key_side_ = side; }

  static constexpr double kFrameWidth_px = 362;
  double width_px() const, height_px() const;  ///< of the SVG
  std::string str() const;                     ///< SVG elements, from (0, 0) to the width and height
  /// The frame with axes and marks as an SVG element. Title, subtitle and key are not in it.
  std::string on_page() const;
  const std::string& title() const { return title_; }
  const std::string& subtitle() const { return subtitle_; }
  const std::string& subtitle_colour() const { return subtitle_colour_; }
  /// text, colour
  const std::vector<std::pair<std::string, std::string>>& keys() const { return keys_; }

 private:
  double ink_height_px() const, left_px() const;
  std::string frame_svg() const;
  std::string title_, subtitle_, subtitle_colour_, second_label_;
  Axis x_, y_;
  std::vector<Mark> marks_;
  double second_factor_ = 0;  ///< 0: no second axis
  double frame_height_px_;
  bool are_scales_same_ = false;
  std::vector<std::pair<std::string, std::string>> keys_;
  KeySide key_side_ = KeySide::right;
};

/// Shaft and two-stroke head of an arrow from (0, 0), as the path of an SVG; short arrows get a short head, those of
/// less than a dot nothing.
std::string arrow_path(Vec2 shift_px);

/// Charts beside each other in rows, with lines of text below, as a file of its own.
std::string svg_file(const std::vector<Chart>& charts, int n_columns, const std::vector<std::string>& caption);

}  // namespace mbtfm::charts
