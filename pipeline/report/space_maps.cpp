#include "pipeline/report/space_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/charts/colour_map.h"
#include "pipeline/contract/extent.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/report/arrows.h"
#include "pipeline/report/numbers.h"

namespace mbtfm::report {
namespace {

using charts::Chart;

Vec2 spacing_of(const SpaceResults& r) { return {r.number("spacing_x_um"), r.number("spacing_y_um")}; }

Chart empty_map(const SpaceResults& r, const std::string& title) {
  const auto [low, high] = extent_of(r.tractions, &SurfaceTraction::at_um);
  const Vec2 half = 0.5 * spacing_of(r);
  Chart map(title, {"x (µm)", low.x - half.x, high.x + half.x}, {"y (µm)", high.y + half.y, low.y - half.y});
  map.same_scales();
  return map;
}

/// Every vertex stands for a cell of the lattice.
template <class Value, class Colour>
void draw_cells(Chart& map, const SpaceResults& r, const Value& value, const Colour& colour, const std::string& unit) {
  const Vec2 half = 0.5 * spacing_of(r);
  for (const SurfaceTraction& t : r.tractions) {
    const std::optional<double> v = value(t);
    if (!v) continue;
    const Vec2 at{t.at_um.x, t.at_um.y};
    map.bar(at - half, at + half, "fill:" + colour(*v) + ";stroke:none",
            fmt::format("{} {} at x, y, z = {:.1f}, {:.1f}, {:.1f} µm", readable(*v), unit, at.x, at.y, t.at_um.z));
  }
}

/// What is known of the cell, laid onto the surface from above.
void draw_cell(Chart& map, const SpaceResults& r) {
  constexpr int kCorners = 16;
  if (!r.outline_um.empty()) map.polygon(r.outline_um, "fill:none;stroke:#444;stroke-width:1;stroke-dasharray:5 3");
  for (const Adhesion& a : r.adhesions)
    map.polygon(ellipse_corners(a, kCorners), "fill:none;stroke:#111;stroke-width:1.2",
                fmt::format("adhesion {}", a.adhesion_id));
}

/// White in the middle; red and blue differ to colour-blind eyes, too (Brewer's RdBu).
std::string signed_colour(double share) {
  constexpr charts::Colour kWhite{255, 255, 255}, kOut{178, 24, 43}, kIn{33, 102, 172};
  const charts::Colour& end = share > 0 ? kOut : kIn;
  const double s = std::min(1.0, std::abs(share));
  charts::Colour mixed;
  for (std::size_t c = 0; c < 3; ++c) mixed[c] = kWhite[c] + s * (end[c] - kWhite[c]);
  return charts::hex(mixed);
}

std::string signed_bar(double top) {
  return fmt::format(
      "<span class=\"bar\"><span class=\"ink\"><i style=\"background:linear-gradient(90deg,{},#fff,{})\"></i><span "
      "style=\"left:0%\">−{}</span><span style=\"left:50%\">0</span><span style=\"left:100%\">{}</span></span>normal "
      "traction (kPa), above 0 out of the gel</span>",
      signed_colour(-1), signed_colour(1), readable(top), readable(top));
}

/// Of a map of values from zero on.
template <class Value>
Figure scalar_map(const SpaceResults& r, const std::string& title, const std::string& what, const std::string& unit,
                  const Value& value, const std::string& caption) {
  Chart map = empty_map(r, title);
  std::vector<double> values;
  for (const SurfaceTraction& t : r.tractions)
    if (const std::optional<double> v = value(t)) values.push_back(*v);
  constexpr double kNearlyAll = 0.99;  // a cell at the rim must not take all the colours
  const ColourScale scale{0, round_end(numerics::quantile(values, kNearlyAll)), what + " (" + unit + ")"};
  draw_cells(
      map, r, value, [&](double v) { return scale.colour(v); }, unit);
  draw_cell(map, r);
  return {std::move(map), caption, legend(colour_bar(scale))};
}

constexpr const char* kFromAbove = "Seen from above: steep parts look narrower than they are.";

/// A bead and the surface in a vertical plane.
struct Plane {
  const char *title, *across, *along;
  double Vec3::*x;  ///< along the plane
  double Vec3::*y;  ///< across it
};

void draw_surface(Chart& chart, const HeightMap& map, bool is_along_x, double at_um) {
  std::vector<Vec2> line;
  const int n = is_along_x ? map.n_x : map.n_y, m = is_along_x ? map.n_y : map.n_x;
  const double origin = is_along_x ? map.origin_um.y : map.origin_um.x,
               spacing = is_along_x ? map.spacing_um.y : map.spacing_um.x;
  const int other = std::clamp(static_cast<int>(std::lround((at_um - origin) / spacing)), 0, m - 1);
  for (int k = 0; k < n; ++k) {
    const int i = is_along_x ? k : other, j = is_along_x ? other : k;
    const auto v = static_cast<std::size_t>(j) * static_cast<std::size_t>(map.n_x) + static_cast<std::size_t>(i);
    const Vec2 p = map.vertex_um(v);
    line.push_back({is_along_x ? p.x : p.y, map.z_um[v]});
  }
  chart.curve(line, "fill:none;stroke:#111;stroke-width:1.6");
}

}  // namespace

ColourScale traction_colours(const SpaceResults& r) {
  std::vector<double> sizes;
  for (const SurfaceTraction& t : r.tractions) sizes.push_back(norm(t.traction_kPa));
  return {0, round_end(numerics::quantile(sizes, 0.99)), "traction (kPa)"};
}

Figure normal_map(const SpaceResults& r) {
  Chart map = empty_map(r, "Normal traction");
  std::vector<double> sizes;
  for (const SurfaceTraction& t : r.tractions) sizes.push_back(std::abs(t.normal_kPa));
  const double top = round_end(numerics::quantile(sizes, 0.99));
  draw_cells(
      map, r, [](const SurfaceTraction& t) { return std::optional(t.normal_kPa); },
      [&](double v) { return signed_colour(top > 0 ? v / top : 0); }, "kPa");
  draw_cell(map, r);
  return {std::move(map), std::string("Red: the cell pulls the gel outwards; blue: it presses on it. ") + kFromAbove,
          legend(top > 0 ? signed_bar(top) : std::string())};
}

Figure tangential_map(const SpaceResults& r) {
  Figure figure = scalar_map(
      r, "Tangential traction", "traction along the surface", "kPa",
      [](const SurfaceTraction& t) { return std::optional(t.tangential_kPa); },
      std::string("Arrows: the part of the traction in x and y. ") + kFromAbove);
  std::vector<Vec2> vectors;
  for (const SurfaceTraction& t : r.tractions) vectors.push_back({t.traction_kPa.x, t.traction_kPa.y});
  const ArrowScale scale = arrow_scale(vectors);
  for (std::size_t k = 0; k < vectors.size(); ++k) {
    constexpr double kShown = 0.15;  // of the longest: shorter ones are dots
    if (norm(vectors[k]) < kShown * scale.top) continue;
    const Vec3 at = r.tractions[k].at_um;
    figure.chart.arrow({at.x, at.y}, scale.px_per_unit * vectors[k], "fill:none;stroke:#fff;stroke-width:1.2");
  }
  return figure;
}

std::optional<Figure> error_map(const SpaceResults& r) {
  if (!r.tractions.front().sigma_kPa) return std::nullopt;
  return scalar_map(
      r, "Standard error of the traction", "standard error", "kPa",
      [](const SurfaceTraction& t) {
        return t.sigma_kPa ? std::optional(norm(*t.sigma_kPa) / std::sqrt(3.0)) : std::nullopt;
      },
      "Of one component, root mean square of the three: the noise of the beads, and what they do not resolve.");
}

std::optional<Figure> resolution_map(const SpaceResults& r) {
  if (!r.tractions.front().resolution_um) return std::nullopt;
  return scalar_map(
      r, "Resolution", "distance", "µm", [](const SurfaceTraction& t) { return t.resolution_um; },
      "Forces closer together than this look like one. From about twice that on they are mostly seen as two.");
}

std::vector<Figure> bead_slices(const SpaceResults& r) {
  const auto strongest = std::ranges::max_element(
      r.tractions, {}, [](const SurfaceTraction& t) { return norm(t.traction_kPa) * t.area_um2; });
  const double thickness_um = 2 * r.number("bead_distance_um");
  double low = 1e300, high = -1e300, bottom = -1e300, top = 1e300;
  for (const BeadInSpace& bead : r.beads) {
    low = std::min({low, bead.position_um.x, bead.position_um.y});
    high = std::max({high, bead.position_um.x, bead.position_um.y});
    top = std::min(top, bead.position_um.z);
    bottom = std::max(bottom, bead.position_um.z);
  }
  std::vector<Figure> figures;
  for (const Plane& plane : {Plane{"Beads in a slice along x", "y", "x (µm)", &Vec3::x, &Vec3::y},
                             Plane{"Beads in a slice along y", "x", "y (µm)", &Vec3::y, &Vec3::x}}) {
    const double at_um = strongest->at_um.*plane.y;
    Chart chart(plane.title, {plane.along, low, high}, {"z (µm), into the gel", bottom + 2, top - 2});
    chart.same_scales();
    draw_surface(chart, r.surface, plane.x == &Vec3::x, at_um);
    VectorField field;
    for (const BeadInSpace& bead : r.beads) {
      if (std::abs(bead.position_um.*plane.y - at_um) > 0.5 * thickness_um) continue;
      const Vec2 at{bead.position_um.*plane.x, bead.position_um.z};
      if (!bead.flag.empty()) {
        chart.dot(at, 1.6, "fill:none;stroke:#999;stroke-width:1", bead.flag);
        continue;
      }
      field.positions_um.push_back(at);
      field.vectors.push_back({bead.displacement_um.*plane.x, bead.displacement_um.z});
      chart.dot(at, 1.2, "fill:#888;stroke:none");
    }
    const std::string bar = draw_arrows(chart, field, arrow_scale(field.vectors), "displacement in the slice", "µm");
    figures.push_back({std::move(chart),
                       fmt::format("All beads within {} µm of {} = {:.1f} µm, where the strongest traction is. Line: "
                                   "the surface. Circles: beads that were left out.",
                                   readable(0.5 * thickness_um), plane.across, at_um),
                       bar});
  }
  return figures;
}

}  // namespace mbtfm::report
