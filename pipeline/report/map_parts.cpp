#include "pipeline/report/map_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "pipeline/charts/colour_map.h"
#include "pipeline/files/base64.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::report {
namespace {

// Arrows across the map at most: one every 12 px of a frame as the charts' SVG has it.
constexpr double kArrowsAcross = 31;
// The mean of nine beads has a third of their noise.
constexpr double kMembers = 9;
// Squares cut by the map's rim hold fewer; the mean of two would show their noise.
constexpr std::size_t kFewest = 3;

bool is_inside(const Extent& box, Vec2 p) {
  return p.x >= box.low_um.x && p.x <= box.high_um.x && p.y >= box.low_um.y && p.y <= box.high_um.y;
}

}  // namespace

charts::Chart empty_map(const Extent& box, const std::string& title) {
  charts::Chart map(title, {"x (µm)", box.low_um.x, box.high_um.x}, {"y (µm)", box.high_um.y, box.low_um.y});
  map.same_scales();
  return map;
}

std::string ColourScale::colour(double value) const {
  return charts::hex(charts::colour_at(charts::ColourMap::plasma, high > low ? (value - low) / (high - low) : 0));
}

double round_end(double value) {
  if (!(value > 0)) return 0;
  const std::vector<double> list = charts::ticks(0, value);
  return list.back() >= value ? value : list.back() + list[1];
}

std::string colour_bar(const ColourScale& scale) {
  if (!(scale.high > scale.low)) return {};
  std::string stops, numbers;
  for (const double share : charts::stops_of(charts::ColourMap::plasma))
    stops += "," + scale.colour(scale.low + share * (scale.high - scale.low));
  for (const double tick : charts::ticks(scale.low, scale.high)) {
    numbers += fmt::format("<span style=\"left:{:.1f}%\">{}</span>",
                           100 * (tick - scale.low) / (scale.high - scale.low), charts::readable(tick));
  }
  return fmt::format(
      "<span class=\"bar\"><span class=\"ink\"><i style=\"background:linear-gradient(90deg{})\"></i>{}</span>{}</span>",
      stops, numbers, charts::html_escaped(scale.label));
}

std::string legend(const std::string& items) {
  return items.empty() ? items : "<div class=\"legend\">" + items + "</div>\n";
}

VectorField displacement_of(const DisplacementField& beads) {
  VectorField field;
  for (const Bead& bead : beads) {
    if (!bead.flag.empty()) continue;
    field.positions_um.push_back(bead.position_um);
    field.vectors.push_back(bead.displacement_um);
  }
  return field;
}

double averaging_side_um(const VectorField& field, const Extent& box) {
  const Vec2 size = box.high_um - box.low_um;
  const auto n_inside = std::ranges::count_if(field.positions_um, [&](Vec2 p) { return is_inside(box, p); });
  const double needed_um = n_inside > 0 ? std::sqrt(kMembers * box.area_um2() / static_cast<double>(n_inside)) : size.x;
  // a whole number of squares across
  return size.x / std::clamp(std::floor(size.x / needed_um), 1.0, kArrowsAcross);
}

AveragedField averaged(const VectorField& field, const Extent& box, double side_um) {
  std::map<std::pair<int, int>, std::vector<std::size_t>> squares;
  std::size_t n_inside = 0;
  for (std::size_t i = 0; i < field.positions_um.size(); ++i) {
    const Vec2 p = field.positions_um[i];
    if (!is_inside(box, p)) continue;
    ++n_inside;
    squares[{static_cast<int>((p.y - box.low_um.y) / side_um), static_cast<int>((p.x - box.low_um.x) / side_um)}]
        .push_back(i);
  }
  AveragedField result;
  for (const auto& [place, members] : squares) {
    if (members.size() < kFewest) continue;
    Vec2 position, vector;
    for (const std::size_t i : members) {
      position += field.positions_um[i];
      vector += field.vectors[i];
    }
    const double share = 1.0 / static_cast<double>(members.size());
    result.means.positions_um.push_back(share * position);
    result.means.vectors.push_back(share * vector);
  }
  if (!squares.empty()) result.mean_members = static_cast<double>(n_inside) / static_cast<double>(squares.size());
  return result;
}

ArrowScale arrow_scale(const std::vector<Vec2>& vectors) {
  // The longest arrows but for the top 1 %, in px of such a frame: long enough to compare, short enough to distinguish.
  constexpr double kLongArrow_px = 32;
  std::vector<double> lengths;
  for (const Vec2 v : vectors) lengths.push_back(norm(v));
  const double top = numerics::quantile(lengths, 0.99);
  return {.top = top, .px_per_unit = top > 0 ? kLongArrow_px / top : 0};
}

std::string draw_arrows(charts::Chart& map, const VectorField& field, const ArrowScale& scale, const std::string& what,
                        const std::string& unit) {
  if (!(scale.top > 0)) return {};
  const ColourScale colours{.low = 0, .high = round_end(scale.top), .label = what + " (" + unit + ")"};
  for (std::size_t i = 0; i < field.vectors.size(); ++i) {
    map.arrow(field.positions_um[i], scale.px_per_unit * field.vectors[i],
              "stroke-width:1.4;stroke:" + colours.colour(norm(field.vectors[i])));
  }
  return legend(arrow_legend(scale, unit) + colour_bar(colours));
}

std::string arrow_legend(const ArrowScale& scale, const std::string& unit) {
  if (!(scale.top > 0)) return {};
  const double value = charts::round_below(scale.top), length_px = scale.px_per_unit * value;
  // --frame: width of the frame in that of the charts' SVG; set by the page's script
  return fmt::format(
      "<span class=\"arrow\"><svg viewBox=\"0 -6 {0:.1f} 12\" preserveAspectRatio=\"none\" "
      "style=\"width:calc({0:.1f}px*var(--frame,1))\"><path d=\"{1}\" "
      "style=\"fill:none;stroke:#111;stroke-width:1.6;vector-effect:non-scaling-stroke\"/></svg>{2} {3}</span>",
      length_px, charts::arrow_path({length_px, 0}), charts::readable(value), unit);
}

std::string picture_of_squares(const VectorField& field, double side_um, const Extent& box,
                               const ColourScale& colours) {
  constexpr int kColours = 48;  // neighbours are hardly distinguished
  // by colour, as paths in a frame whose unit is a hundredth of a side; neighbours of one colour along x are one piece
  std::map<int, std::string> pieces;
  const std::size_t n = field.positions_um.size();
  const auto colour_at = [&](std::size_t i) {
    const double share = colours.high > 0 ? std::min(1.0, norm(field.vectors[i]) / colours.high) : 0;
    return static_cast<int>(std::round(kColours * share));
  };
  for (std::size_t i = 0, next = 0; i < n; i = next) {
    const int colour = colour_at(i);
    const double y_um = field.positions_um[i].y;
    for (next = i + 1; next < n && field.positions_um[next].y == y_um && colour_at(next) == colour;) ++next;
    const Vec2 corner = 100 / side_um * (field.positions_um[i] - box.low_um) - Vec2{50, 50};
    // a hundredth more than its sides: no gaps by rounding
    const auto width = 100 * (next - i) + 1;
    pieces[colour] += fmt::format("M{:.0f} {:.0f}h{}v101h-{}", corner.x, corner.y, width, width);
  }
  const Vec2 size = 100 / side_um * (box.high_um - box.low_um);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "preserveAspectRatio=\"none\" shape-rendering=\"crispEdges\">",
      size.x, size.y);
  for (const auto& [step, path] : pieces)
    svg += fmt::format("<path fill=\"{}\" d=\"{}\"/>", colours.colour(colours.high * step / kColours), path);
  return "data:image/svg+xml;base64," + files::base64(svg + "</svg>");
}

}  // namespace mbtfm::report
