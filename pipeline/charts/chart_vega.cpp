/// Charts as specifications for Vega, version 5. Zooming is a change of the signals xdom and ydom; it moves and
/// stretches what was drawn once, so that lines of thousands of points stay quick.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "pipeline/charts/chart.h"
#include "pipeline/contract/words.h"
#include "pipeline/files/json.h"

namespace mbtfm::charts {
namespace {

using nlohmann::ordered_json;
using Kind = Mark::Kind;

// Lines are given in steps of 1/10 000 of the frame: a tenth of a px where one zooms in tenfold.
constexpr double kSteps = 10000;
constexpr double kTextSize_px = 13, kTextWidth_px = 7.4;  // the width is that of a usual letter

ordered_json signal(const std::string& expression) { return {{"signal", expression}}; }

ordered_json number_list(const std::string& text) {
  ordered_json numbers = ordered_json::array();
  for (std::size_t i = 0; i < text.size(); i = std::min(text.find_first_of(" ,", i), text.size() - 1) + 1)
    numbers.push_back(std::stod(text.substr(i)));
  return numbers;
}

/// CSS of SVG by the names that Vega gives it.
ordered_json properties(const std::string& style) {
  struct Property {
    const char* name;
    ordered_json (*value)(const std::string&);
  };
  const auto text = [](const std::string& value) { return ordered_json(value); };
  const auto number = [](const std::string& value) { return ordered_json(std::stod(value)); };
  static const std::map<std::string, Property> kProperties = {
      {"fill", {"fill", text}},
      {"fill-opacity", {"fillOpacity", number}},
      {"opacity", {"opacity", number}},
      {"stroke", {"stroke", text}},
      {"stroke-dasharray", {"strokeDash", number_list}},
      {"stroke-linecap", {"strokeCap", text}},
      {"stroke-linejoin", {"strokeJoin", text}},
      {"stroke-opacity", {"strokeOpacity", number}},
      {"stroke-width", {"strokeWidth", number}},
  };
  ordered_json result = ordered_json::object();
  for (std::size_t at = 0; at < style.size();) {
    const std::size_t end = std::min(style.find(';', at), style.size()), colon = style.find(':', at);
    if (colon < end) {
      const auto property = kProperties.find(style.substr(at, colon - at));
      const std::string value = style.substr(colon + 1, end - colon - 1);
      if (property != kProperties.end() && value != "none")
        result[property->second.name] = property->second.value(value);
    }
    at = end + 1;
  }
  return result;
}

struct Axes {
  const Axis &x, &y;

  /// "123,456", in steps from the lower left corner; empty where a point has no place.
  std::string point(Vec2 p) const {
    const Vec2 at{kSteps * share(x, p.x), kSteps * share(y, p.y)};
    return is_finite(at) ? fmt::format("{:.0f},{:.0f}", at.x, at.y) : std::string();
  }
};

std::string path_of(const Mark& mark, const Axes& axes) {
  std::string path;
  for (std::size_t i = 0; i < mark.points.size(); ++i) {
    const std::string at = axes.point(mark.points[i]);
    if (at.empty()) continue;
    const bool is_start = path.empty() || (mark.kind == Kind::pieces && i % 2 == 0);
    path += (is_start ? "M" : "L") + at;
  }
  return mark.kind == Kind::polygon ? path + "Z" : path;
}

/// The kind of mark that Vega has for each of ours, in their order.
constexpr std::array kVegaKinds = {"path",   "path", "path", "rect", "rule", "symbol",
                                   "symbol", "path", "rule", "rule", "text", "image"};

bool is_path(Kind kind) { return kind == Kind::curve || kind == Kind::polygon || kind == Kind::pieces; }

/// Marks that one of Vega's can stand for: of one kind, drawn right after each other.
bool go_together(const Mark& a, const Mark& b) {
  return (a.kind == b.kind || (is_path(a.kind) && is_path(b.kind))) && a.hover.empty() == b.hover.empty();
}

/// Six digits: what one can see where one zooms in a thousandfold.
// std::stod would throw where the number is too small for full precision.
double short_number(double value) { return std::strtod(fmt::format("{:.6g}", value).c_str(), nullptr); }

ordered_json row_of(const Mark& mark, const Axes& axes) {
  ordered_json row = properties(mark.style);
  if (!mark.hover.empty()) row["tooltip"] = mark.hover;
  if (is_path(mark.kind)) {
    if (mark.kind != Kind::polygon) row.erase("fill");
    row["path"] = path_of(mark, axes);
    return row;
  }
  const Vec2 from = mark.points.front(), to = mark.points.back();
  row["x"] = short_number(from.x);
  row["y"] = short_number(from.y);
  if (mark.points.size() > 1) {
    row["x2"] = short_number(to.x);
    row["y2"] = short_number(to.y);
  }
  if (mark.kind == Kind::diamond) row["shape"] = "diamond";
  if (mark.kind == Kind::dot || mark.kind == Kind::diamond)
    row["size"] = std::pow(2 * mark.radius_px, 2);  // of the square around it
  if (mark.kind == Kind::arrow) row["path"] = arrow_path(mark.shift_px);
  if (mark.kind == Kind::label) row["text"] = mark.text;
  if (mark.kind == Kind::picture) row["url"] = mark.text;
  return row;
}

/// Where Vega puts the marks of a kind: by the scales, or by moving and stretching the frame's steps.
ordered_json place_of(Kind kind) {
  ordered_json place = ordered_json::object();
  if (is_path(kind)) {
    return {{"x", signal("x_origin")},
            {"y", signal("y_origin")},
            {"scaleX", signal("x_step")},
            {"scaleY", signal("y_step")}};
  }
  for (const char* axis : {"x", "y"}) place[axis] = {{"scale", axis}, {"field", axis}};
  if (kind == Kind::bar || kind == Kind::error || kind == Kind::picture) {
    place["x2"] = {{"scale", "x"}, {"field", "x2"}};
    place["y2"] = {{"scale", "y"}, {"field", "y2"}};
  }
  if (kind == Kind::upright) place.update({{"y", {{"value", 0}}}, {"y2", signal("height")}});
  if (kind == Kind::level) place.update({{"x", {{"value", 0}}}, {"x2", signal("width")}});
  if (kind == Kind::picture) place["aspect"] = {{"value", false}};
  if (kind == Kind::arrow) place.update({{"scaleX", signal("arrow_scale")}, {"scaleY", signal("arrow_scale")}});
  if (kind == Kind::label) {
    place.update({{"align", {{"value", "center"}}},
                  {"baseline", {{"value", "middle"}}},
                  {"fontSize", {{"value", kTextSize_px}}},
                  {"fontWeight", {{"value", 600}}},
                  {"fill", {{"value", "#1a1d21"}}}});
  }
  return place;
}

/// A text's white rim lies below it, as one mark more.
ordered_json rim_of(ordered_json text) {
  text["encode"]["update"].update({{"fill", {{"value", "#fff"}}},
                                   {"stroke", {{"value", "#fff"}}},
                                   {"strokeWidth", {{"value", 4}}},
                                   {"strokeJoin", {{"value", "round"}}}});
  return text;
}

/// The two stops of error bars: short rules across them.
std::vector<ordered_json> stops_of(const ordered_json& bars) {
  constexpr double kStop_px = 4;  // half of their length
  std::vector<ordered_json> stops;
  for (const std::string end : {"", "2"}) {
    ordered_json stop = bars;
    ordered_json& place = stop["encode"]["update"];
    const ordered_json x = place["x" + end], y = place["y" + end];
    const auto moved = [](ordered_json at, const char* if_across, double by) {
      at["offset"] = signal(fmt::format("({}) ? {} : 0", if_across, by));
      return at;
    };
    place["x"] = moved(x, "datum.x === datum.x2", -kStop_px);
    place["x2"] = moved(x, "datum.x === datum.x2", kStop_px);
    place["y"] = moved(y, "datum.x !== datum.x2", -kStop_px);
    place["y2"] = moved(y, "datum.x !== datum.x2", kStop_px);
    stops.push_back(stop);
  }
  return stops;
}

/// What all rows share goes from them into the mark.
ordered_json mark_of(Kind kind, const std::string& data, ordered_json& rows) {
  ordered_json update = place_of(kind);
  static const std::set<std::string> kPlaces = {"x", "y", "x2", "y2"};
  std::vector<std::string> names;
  for (const ordered_json& row : rows) {
    for (const auto& [name, value] : row.items())
      if (!kPlaces.contains(name) && std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  for (const std::string& name : names) {
    const bool is_shared = std::all_of(rows.begin(), rows.end(), [&](const ordered_json& row) {
      return row.contains(name) && row.at(name) == rows.front().value(name, ordered_json());
    });
    update[name] = is_shared ? ordered_json{{"value", rows.front().at(name)}} : ordered_json{{"field", name}};
    if (!is_shared) continue;
    for (ordered_json& row : rows) row.erase(name);
  }
  return {{"type", kVegaKinds.at(static_cast<std::size_t>(kind))},
          {"from", {{"data", data}}},
          {"clip", true},
          {"aria", false},  // read aloud is the chart's name; a table beside it has the numbers
          {"interactive", update.contains("tooltip")},
          {"encode", {{"update", update}}}};
}

/// Adds the marks from `first` to before `last` as one data set.
void add_marks(ordered_json& spec, const std::vector<Mark>& marks, std::size_t first, std::size_t last,
               const Axes& axes) {
  ordered_json rows = ordered_json::array();
  for (std::size_t i = first; i < last; ++i) {
    const bool has_place = std::ranges::all_of(marks[i].points, [&](Vec2 p) {
      return std::isfinite(share(axes.x, p.x)) && std::isfinite(share(axes.y, p.y));
    });
    if (has_place || is_path(marks[i].kind)) rows.push_back(row_of(marks[i], axes));
  }
  if (rows.empty()) return;
  const Kind kind = marks[first].kind;
  const std::string data = fmt::format("marks{}", first);
  const ordered_json mark = mark_of(kind, data, rows);
  if (kind == Kind::label) spec["marks"].push_back(rim_of(mark));
  spec["marks"].push_back(mark);
  if (kind == Kind::error)
    for (const ordered_json& stop : stops_of(mark)) spec["marks"].push_back(stop);
  spec["data"].push_back({{"name", data}, {"values", rows}});
}

/// Where an axis is drawn.
enum class Side { x, y, upper_x };
constexpr auto words(Side) { return std::array{"x", "y", "x2"}; }

/// Signals that say where the frame's steps lie while xdom (ydom) is shown.
void add_axis_signals(ordered_json& spec, Side side, const Axis& axis) {
  const std::string name = name_of(side);
  const bool is_log = axis.scale == Scale::logarithmic;
  const auto scaled = [&](double value) { return is_log ? std::log(value) : value; };
  const auto shown = [&](int i) { return fmt::format(fmt::runtime(is_log ? "log({}dom[{}])" : "{}dom[{}]"), name, i); };
  const std::string length = side == Side::x ? "width" : "-height", zero = side == Side::x ? "" : "height + ";
  const std::string span = "(" + shown(1) + " - " + shown(0) + ")";
  spec["signals"].push_back({{"name", name + "dom"}, {"value", {axis.low, axis.high}}});
  spec["signals"].push_back(
      {{"name", name + "_origin"},
       {"update", fmt::format("{}{} * ({} - {}) / {}", zero, length, scaled(axis.low), shown(0), span)}});
  spec["signals"].push_back(
      {{"name", name + "_step"},
       {"update", fmt::format("{} * {} / {}", length, (scaled(axis.high) - scaled(axis.low)) / kSteps, span)}});
}

ordered_json scale_of(Side side, const Axis& axis, const ordered_json& domain) {
  return {{"name", name_of(side)}, {"type", axis.scale == Scale::logarithmic ? "log" : "linear"},
          {"domain", domain},      {"range", side == Side::y ? "height" : "width"},
          {"zero", false},         {"nice", false}};
}

std::size_t longest_name(const Axis& axis) {
  std::size_t longest = 0;
  for (const auto& [value, name] : axis.names) longest = std::max(longest, name.size());
  return longest;
}

ordered_json axis_of(Side side, const Axis& axis) {
  const bool is_upright = side == Side::y;
  constexpr std::array kOrients = {"bottom", "left", "top"};
  ordered_json result = {{"scale", name_of(side)},        {"orient", kOrients.at(static_cast<std::size_t>(side))},
                         {"title", axis.label},           {"grid", side != Side::upper_x},
                         {"gridColor", "#e3e5e8"},        {"domain", false},
                         {"tickColor", "#444"},           {"labelFontSize", kTextSize_px},
                         {"titleFontSize", kTextSize_px}, {"titleFontWeight", "normal"},
                         {"labelColor", "#1a1d21"},       {"titleColor", "#1a1d21"},
                         {"labelOverlap", true}};
  if (axis.names.empty()) {
    result["tickCount"] = signal(is_upright ? "max(3, height / 50)" : "max(3, width / 80)");
    return result;
  }
  ordered_json values = ordered_json::array(), names = ordered_json::array();
  for (const auto& [value, name] : axis.names) {
    values.push_back(value);
    names.push_back(name);
  }
  result["values"] = values;
  if (!is_upright) result["grid"] = false;
  result["labelOverlap"] = false;
  const std::string name = files::json_text(names) + "[indexof(" + files::json_text(values) + ", datum.value)]";
  // side by side they need their lengths and a gap; in a narrower frame each word has its own line
  const double needed_px = kTextWidth_px * static_cast<double>(axis.names.size() * (longest_name(axis) + 2));
  result["encode"]["labels"]["update"]["text"] =
      signal(is_upright ? name : fmt::format("width < {:.0f} ? split({}, ' ') : {}", needed_px, name, name));
  return result;
}

/// Room for the numbers or names of an upright axis and its title.
double left_room_px(const Axis& axis) {
  const double largest = std::max(std::abs(axis.low), std::abs(axis.high));
  const std::size_t number = fmt::format("{:.0f}", largest).size(), with_commas = number + (number - 1) / 3;
  return kTextWidth_px * static_cast<double>(std::max({std::size_t{5}, with_commas, longest_name(axis)})) +
         (axis.label.empty() ? 12 : 28);
}

}  // namespace

std::string Chart::vega() const {
  const Axes axes{x_, y_};
  constexpr double kTop_px = 10, kUpperAxis_px = 36, kRight_px = 16, kBottom_px = 44;
  ordered_json spec = {{"$schema", "vega/v5.json"},
                       {"description", title_},
                       {"autosize", "none"},
                       {"width", 400},
                       {"height", frame_height_px_},
                       {"padding",
                        {{"left", left_room_px(y_)},
                         {"right", kRight_px},
                         {"top", kTop_px + (second_factor_ > 0 ? kUpperAxis_px : 0)},
                         {"bottom", kBottom_px}}},
                       {"signals", ordered_json::array()},
                       {"scales", {scale_of(Side::x, x_, signal("xdom")), scale_of(Side::y, y_, signal("ydom"))}},
                       {"axes", {axis_of(Side::x, x_), axis_of(Side::y, y_)}},
                       {"data", ordered_json::array()},
                       {"marks", ordered_json::array()}};
  if (are_scales_same_) {
    spec.erase("height");
    spec["signals"].push_back(
        {{"name", "height"}, {"update", fmt::format("width * {}", std::abs((y_.high - y_.low) / (x_.high - x_.low)))}});
  }
  spec["signals"].push_back({{"name", "arrow_scale"}, {"update", fmt::format("width / {}", kFrameWidth_px)}});
  add_axis_signals(spec, Side::x, x_);
  add_axis_signals(spec, Side::y, y_);
  if (second_factor_ > 0) {
    const Axis second{second_label_, x_.low, x_.high, x_.scale};
    spec["scales"].push_back(
        scale_of(Side::upper_x, second, signal(fmt::format("[{0} * xdom[0], {0} * xdom[1]]", second_factor_))));
    spec["axes"].push_back(axis_of(Side::upper_x, second));
  }
  for (std::size_t first = 0, last = 0; first < marks_.size(); first = last) {
    for (last = first; last < marks_.size() && go_together(marks_[first], marks_[last]); ++last) continue;
    add_marks(spec, marks_, first, last, axes);
  }
  return files::json_text(spec);
}

}  // namespace mbtfm::charts
