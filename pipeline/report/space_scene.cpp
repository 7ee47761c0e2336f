#include "pipeline/report/space_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

#include "pipeline/charts/chart.h"
#include "pipeline/contract/extent.h"

namespace mbtfm::report {
namespace {

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

/// Heights on a coarser lattice where there are more than the eye tells apart.
struct Heights {
  const HeightMap& map;
  int step = 1;
  int n_x() const { return (map.n_x - 1) / step + 1; }
  int n_y() const { return (map.n_y - 1) / step + 1; }
  Vec3 at(int i, int j) const {
    const auto k =
        static_cast<std::size_t>(j * step) * static_cast<std::size_t>(map.n_x) + static_cast<std::size_t>(i * step);
    const Vec2 p = map.vertex_um(k);
    return {p.x, p.y, map.z_um[k]};
  }
};

Heights heights_of(const HeightMap& map) {
  constexpr int kMostLines = 60;  // a facet is a dozen pixels long
  return {map, std::max(1, (std::max(map.n_x, map.n_y) - 1) / kMostLines)};
}

Paper paper_over(const Heights& heights) {
  Vec2 low{1e300, 1e300}, high{-1e300, -1e300};
  for (int j = 0; j < heights.n_y(); ++j) {
    for (int i = 0; i < heights.n_x(); ++i) {
      const Vec2 p = seen(heights.at(i, j)).at;
      low = {std::min(low.x, p.x), std::min(low.y, p.y)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
  }
  Paper paper{.low = low, .px_per_um = (kWidth_px - 2 * kMargin_px) / (high.x - low.x)};
  paper.height_px = 2 * kMargin_px + paper.px_per_um * (high.y - low.y);
  return paper;
}

std::string point(Vec2 p) { return fmt::format("{:.1f},{:.1f}", p.x, p.y); }

void add_facets(const Heights& heights, const TractionOnSurface& field, const ColourScale& colours, const Paper& paper,
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
      const auto t = field.at({middle.x, middle.y});
      const std::string colour = t ? colours.colour(norm(*t)) : "#d8d8d8";
      pieces.push_back(
          {seen(middle).near,
           fmt::format("<polygon points=\"{}\" fill=\"{}\" stroke=\"#fff\" stroke-width=\".35\"/>", points, colour)});
    }
  }
}

/// The strongest fifth, so that they can be told apart; none below a tenth of the largest.
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
    const Vec3 from = t->at_um, to = from + um_per_kPa * t->traction_kPa;
    const Vec2 start = paper.px(from), shift = paper.px(to) - start;
    constexpr double kOverItsFacet_um = 3;  // else the next facet hides its foot
    pieces.push_back(
        {std::max(seen(from).near, seen(to).near) + kOverItsFacet_um,
         fmt::format("<path transform=\"translate({})\" d=\"{}\" fill=\"none\" stroke=\"#111\" stroke-width=\"1.3\"/>",
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
                 fmt::format("x: {} µm", charts::readable(high.x - low.x))) +
         text_at(paper.px(heights.at(0, front / 2)) + Vec2{-40, 30},
                 fmt::format("y: {} µm", charts::readable(high.y - low.y)));
}

}  // namespace

TractionOnSurface::TractionOnSurface(const std::vector<SurfaceTraction>& tractions, Vec2 spacing_um)
    : tractions_(tractions), spacing_um_(spacing_um) {
  const auto [low, high] = extent_of(tractions, &SurfaceTraction::at_um);
  origin_um_ = low;
  n_x_ = static_cast<int>(std::lround((high.x - origin_um_.x) / spacing_um.x)) + 1;
  n_y_ = static_cast<int>(std::lround((high.y - origin_um_.y) / spacing_um.y)) + 1;
  vertex_.assign(static_cast<std::size_t>(n_x_) * static_cast<std::size_t>(n_y_), -1);
  for (std::size_t k = 0; k < tractions.size(); ++k) {
    const auto i = static_cast<std::size_t>(std::lround((tractions[k].at_um.x - origin_um_.x) / spacing_um.x)),
               j = static_cast<std::size_t>(std::lround((tractions[k].at_um.y - origin_um_.y) / spacing_um.y));
    vertex_[j * static_cast<std::size_t>(n_x_) + i] = static_cast<int>(k);
  }
}

int TractionOnSurface::index(int column, int row) const {
  if (column < 0 || row < 0 || column >= n_x_ || row >= n_y_) return -1;
  return vertex_[static_cast<std::size_t>(row) * static_cast<std::size_t>(n_x_) + static_cast<std::size_t>(column)];
}

std::optional<Vec3> TractionOnSurface::at(Vec2 p) const {
  const double x = (p.x - origin_um_.x) / spacing_um_.x, y = (p.y - origin_um_.y) / spacing_um_.y;
  const int i = static_cast<int>(std::floor(x)), j = static_cast<int>(std::floor(y));
  const double u = x - i, v = y - j;
  Vec3 sum{};
  using Corner = std::tuple<int, int, double>;
  for (const auto& [column, row, weight] : {Corner{i, j, (1 - u) * (1 - v)}, Corner{i + 1, j, u * (1 - v)},
                                            Corner{i, j + 1, (1 - u) * v}, Corner{i + 1, j + 1, u * v}}) {
    const int k = index(column, row);
    if (k < 0) return std::nullopt;
    sum += weight * tractions_[k].traction_kPa;
  }
  return sum;
}

std::string picture_in_space(const SpaceResults& results, const ColourScale& colours) {
  const Heights heights = heights_of(results.surface);
  const Paper paper = paper_over(heights);
  const TractionOnSurface field(results.tractions, {results.number("spacing_x_um"), results.number("spacing_y_um")});
  std::vector<Piece> pieces;
  add_facets(heights, field, colours, paper, pieces);
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
