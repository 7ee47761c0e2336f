/// Maps of a cell whose beads are in space, and its surface as a picture.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/charts/colour_map.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/report/maps.h"
#include "pipeline/report/numbers.h"
#include "pipeline/report/space_results.h"
#include "pipeline/report/texts.h"

namespace mbtfm::report {
namespace {

using charts::Chart;

Vec2 spacing_of(const SpaceResults& r) { return {r.number("spacing_x_um"), r.number("spacing_y_um")}; }

Chart new_map(const SpaceResults& r, const std::string& title) {
  const auto [low, high] = extent_of(r.tractions, &SurfaceTraction::position_um);
  const Vec2 half = 0.5 * spacing_of(r);
  return empty_map({low - half, high + half}, title);
}

/// Every vertex represents a cell of the lattice.
template <class Value, class Colour>
void draw_cells(Chart& map, const SpaceResults& r, const Value& value, const Colour& colour, const std::string& unit) {
  const Vec2 half = 0.5 * spacing_of(r);
  for (const SurfaceTraction& t : r.tractions) {
    const std::optional<double> v = value(t);
    if (!v) continue;
    const Vec2 at{t.position_um.x, t.position_um.y};
    map.bar(
        at - half, at + half, "fill:" + colour(*v) + ";stroke:none",
        fmt::format("{} {} at x, y, z = {:.1f}, {:.1f}, {:.1f} µm", readable(*v), unit, at.x, at.y, t.position_um.z));
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

/// A cell at the rim must not take all the colours.
double end_of_colours(const std::vector<double>& values) { return round_end(numerics::quantile(values, 0.99)); }

/// Of a map of values from zero on.
template <class Value>
Figure scalar_map(const SpaceResults& r, const std::string& title, const std::string& what, const std::string& unit,
                  const Value& value, const std::string& caption) {
  Chart map = new_map(r, title);
  std::vector<double> values;
  for (const SurfaceTraction& t : r.tractions)
    if (const std::optional<double> v = value(t)) values.push_back(*v);
  const ColourScale scale{0, end_of_colours(values), what + " (" + unit + ")"};
  draw_cells(
      map, r, value, [&](double v) { return scale.colour(v); }, unit);
  draw_cell(map, r);
  return {std::move(map), caption, legend(colour_bar(scale))};
}

Vec3 vertex_of(const HeightMap& map, int i, int j) {
  const auto k = static_cast<std::size_t>(j) * static_cast<std::size_t>(map.n_x) + static_cast<std::size_t>(i);
  const Vec2 p = map.vertex_um(k);
  return {p.x, p.y, map.z_um[k]};
}

/// A vertical plane, for beads and the surface.
struct Plane {
  const char *title, *across, *along;
  double Vec3::*x;  ///< along the plane
  double Vec3::*y;  ///< across it
};

/// The row or column of the surface's lattice that is nearest to a plane.
std::vector<Vec2> surface_in(const Plane& plane, const HeightMap& map, double at_um) {
  const bool is_along_x = plane.x == &Vec3::x;
  const int n = is_along_x ? map.n_x : map.n_y, m = is_along_x ? map.n_y : map.n_x;
  const double origin = is_along_x ? map.origin_um.y : map.origin_um.x,
               spacing = is_along_x ? map.spacing_um.y : map.spacing_um.x;
  const int other = std::clamp(static_cast<int>(std::lround((at_um - origin) / spacing)), 0, m - 1);
  std::vector<Vec2> line;
  for (int k = 0; k < n; ++k) {
    const Vec3 p = is_along_x ? vertex_of(map, k, other) : vertex_of(map, other, k);
    line.push_back({p.*plane.x, p.z});
  }
  return line;
}

constexpr double kWidth_px = 900, kMargin_px = 46;
constexpr double kTurn = -35 * std::numbers::pi / 180;  // so that neither crests along x nor along y hide each other
constexpr double kAbove = 32 * std::numbers::pi / 180;  // of the eye over the plane of x and y

/// A place on the paper, y down, and how near it is to the eye.
struct Seen {
  Vec2 at;
  double near = 0;
};

Seen seen(Vec3 p) {
  const double x = std::cos(kTurn) * p.x - std::sin(kTurn) * p.y, y = std::sin(kTurn) * p.x + std::cos(kTurn) * p.y;
  // z runs into the gel: down on the paper
  return {{x, std::sin(kAbove) * y + std::cos(kAbove) * p.z}, std::cos(kAbove) * y - std::sin(kAbove) * p.z};
}

struct Piece {
  double near = 0;
  std::string svg;
};

/// From um on the paper to pixels.
struct Paper {
  Vec2 low;
  double px_per_um = 1, height_px = 0;
  Vec2 px(Vec2 um) const { return Vec2{kMargin_px, kMargin_px} + px_per_um * (um - low); }
  Vec2 px(Vec3 um) const { return px(seen(um).at); }
};

/// Heights on a coarser lattice if there are more than the eye resolves.
struct Heights {
  const HeightMap& map;
  int step = 1;
  int n_x() const { return (map.n_x - 1) / step + 1; }
  int n_y() const { return (map.n_y - 1) / step + 1; }
  Vec3 at(int i, int j) const { return vertex_of(map, i * step, j * step); }
};

Heights heights_of(const HeightMap& map) {
  constexpr int kMostLines = 60;  // a facet is a dozen pixels long
  return {map, std::max(1, (std::max(map.n_x, map.n_y) - 1) / kMostLines)};
}

Paper paper_over(const Heights& heights) {
  std::vector<Vec2> all;
  for (int j = 0; j < heights.n_y(); ++j)
    for (int i = 0; i < heights.n_x(); ++i) all.push_back(seen(heights.at(i, j)).at);
  const auto [low, high] = extent_of(all);
  Paper paper{.low = low, .px_per_um = (kWidth_px - 2 * kMargin_px) / (high.x - low.x)};
  paper.height_px = 2 * kMargin_px + paper.px_per_um * (high.y - low.y);
  return paper;
}

std::string point(Vec2 p) { return fmt::format("{:.1f},{:.1f}", p.x, p.y); }

void add_facets(const Heights& heights, const TractionsBetween& field, const ColourScale& colours, const Paper& paper,
                std::vector<Piece>& pieces) {
  for (int j = 0; j + 1 < heights.n_y(); ++j) {
    for (int i = 0; i + 1 < heights.n_x(); ++i) {
      const Vec3 corners[] = {heights.at(i, j), heights.at(i + 1, j), heights.at(i + 1, j + 1), heights.at(i, j + 1)};
      Vec3 middle{};
      std::string points;
      for (const Vec3& c : corners) {
        middle += 0.25 * c;
        points += point(paper.px(c)) + " ";
      }
      const TractionsBetween::Found found = field.at({middle.x, middle.y});
      const std::string colour = found.is_whole ? colours.colour(norm(found.traction_kPa)) : "#d8d8d8";
      pieces.push_back(
          {seen(middle).near,
           fmt::format("<polygon points=\"{}\" fill=\"{}\" stroke=\"#fff\" stroke-width=\".35\"/>", points, colour)});
    }
  }
}

/// The strongest fifth, so that they can be distinguished; none below a tenth of the largest.
std::vector<const SurfaceTraction*> shown_arrows(const SpaceResults& results) {
  std::vector<const SurfaceTraction*> all;
  for (const SurfaceTraction& t : results.tractions) all.push_back(&t);
  std::ranges::stable_sort(all, std::greater{}, [](const SurfaceTraction* t) { return norm(t->traction_kPa); });
  all.resize(std::max<std::size_t>(1, all.size() / 5));
  const double largest = norm(all.front()->traction_kPa);
  std::erase_if(all, [&](const SurfaceTraction* t) { return !(norm(t->traction_kPa) > 0.1 * largest); });
  return all;
}

void add_arrows(const SpaceResults& results, const Paper& paper, std::vector<Piece>& pieces) {
  const auto arrows = shown_arrows(results);
  if (arrows.empty()) return;
  const double largest = norm(arrows.front()->traction_kPa);
  const double extent_um = std::max(results.surface.high_um().x - results.surface.origin_um.x,
                                    results.surface.high_um().y - results.surface.origin_um.y);
  const double um_per_kPa = extent_um / 7 / largest;
  for (const SurfaceTraction* t : arrows) {
    const Vec3 from = t->position_um, to = from + um_per_kPa * t->traction_kPa;
    const Vec2 start = paper.px(from), shift = paper.px(to) - start;
    constexpr double kOverItsFacet_um = 3;  // else the next facet hides its foot
    pieces.push_back(
        {std::max(seen(from).near, seen(to).near) + kOverItsFacet_um,
         fmt::format(
             "<g transform=\"translate({0})\" fill=\"none\"><path d=\"{1}\" stroke=\"#fff\" stroke-width=\"3.2\"/>"
             "<path d=\"{1}\" stroke=\"#111\" stroke-width=\"1.3\"/></g>",
             point(start), charts::arrow_path(shift))});
  }
}

std::string text_at(Vec2 p, const std::string& text) {
  return fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" font-size=\"13\" text-anchor=\"middle\">{}</text>", p.x, p.y,
                     text);
}

/// Below the middles of the two front edges: their lengths.
std::string edges(const Heights& heights, const Paper& paper) {
  const int right = heights.n_x() - 1, front = heights.n_y() - 1;
  const Vec3 low = heights.at(0, 0), high = heights.at(right, front);
  return text_at(paper.px(heights.at(right / 2, front)) + Vec2{0, 30},
                 fmt::format("x: {} µm", readable(high.x - low.x))) +
         text_at(paper.px(heights.at(0, front / 2)) + Vec2{-40, 30}, fmt::format("y: {} µm", readable(high.y - low.y)));
}

}  // namespace

ColourScale traction_colours(const SpaceResults& r) {
  std::vector<double> sizes;
  for (const SurfaceTraction& t : r.tractions) sizes.push_back(norm(t.traction_kPa));
  return {0, end_of_colours(sizes), "traction (kPa)"};
}

Figure normal_map(const SpaceResults& r) {
  Chart map = new_map(r, "Normal traction");
  std::vector<double> sizes;
  for (const SurfaceTraction& t : r.tractions) sizes.push_back(std::abs(t.normal_kPa));
  const double top = end_of_colours(sizes);
  draw_cells(
      map, r, [](const SurfaceTraction& t) { return std::optional(t.normal_kPa); },
      [&](double v) { return signed_colour(top > 0 ? v / top : 0); }, "kPa");
  draw_cell(map, r);
  return {std::move(map), sentence("space.normal-map") + " " + sentence("space.from-above"),
          legend(top > 0 ? signed_bar(top) : std::string())};
}

Figure tangential_map(const SpaceResults& r) {
  Figure figure = scalar_map(
      r, "Tangential traction", "traction along the surface", "kPa",
      [](const SurfaceTraction& t) { return std::optional(t.tangential_kPa); },
      sentence("space.arrows") + " " + sentence("space.from-above"));
  std::vector<Vec2> vectors;
  for (const SurfaceTraction& t : r.tractions) vectors.push_back({t.traction_kPa.x, t.traction_kPa.y});
  const ArrowScale scale = arrow_scale(vectors);
  for (std::size_t k = 0; k < vectors.size(); ++k) {
    constexpr double kShown = 0.15;  // of the longest: shorter ones are dots
    if (norm(vectors[k]) < kShown * scale.top) continue;
    const Vec3 at = r.tractions[k].position_um;
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
      sentence("space.error-map"));
}

std::optional<Figure> resolution_map(const SpaceResults& r) {
  if (!r.tractions.front().resolution_um) return std::nullopt;
  return scalar_map(
      r, "Resolution", "distance", "µm", [](const SurfaceTraction& t) { return t.resolution_um; },
      sentence("space.resolution-map"));
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
    const double at_um = strongest->position_um.*plane.y;
    Chart chart(plane.title, {plane.along, low, high}, {"z (µm), into the gel", bottom + 2, top - 2});
    chart.same_scales();
    chart.curve(surface_in(plane, r.surface, at_um), "fill:none;stroke:#111;stroke-width:1.6");
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
    figures.push_back(
        {std::move(chart), sentence("space.slice", readable(0.5 * thickness_um), plane.across, at_um), bar});
  }
  return figures;
}

std::string picture_in_space(const SpaceResults& results, const ColourScale& colours) {
  const Heights heights = heights_of(results.surface);
  const Paper paper = paper_over(heights);
  std::vector<Piece> pieces;
  add_facets(heights, TractionsBetween(map_of(results)), colours, paper, pieces);
  add_arrows(results, paper, pieces);
  std::ranges::stable_sort(pieces, {}, &Piece::near);
  std::string svg = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {:.0f} {:.0f}\" style=\"width:100%;max-width:{:.0f}px\" "
      "role=\"img\" aria-label=\"The surface from a side, coloured by traction\" font-family=\"sans-serif\">\n",
      kWidth_px, paper.height_px, kWidth_px);
  for (const Piece& piece : pieces) svg += piece.svg + "\n";
  return svg + edges(heights, paper) + "</svg>\n";
}

}  // namespace mbtfm::report
