#include "mbtfm/tensions/beyond_border.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "mbtfm/tensions/search.h"
#include "pipeline/contract/extent.h"
#include "substrate/greens/models.h"

namespace mbtfm::tensions {

namespace {

constexpr double kDepth_um = 60;  // of a spread cell
constexpr double kPiece_um = 30;  // half of its breadth
constexpr double kMost = 10;      // pieces of a side: a field that is wider has room for rest

struct Piece {
  Vec2 low_um, high_um;
  Polygon ring() const { return {low_um, {high_um.x, low_um.y}, high_um, {low_um.x, high_um.y}}; }
};

/// Once around the field, from its upper left corner.
std::vector<Piece> pieces_around(const Extent& field) {
  const auto& [low, high] = field;
  const Vec2 size = high - low, deep{kDepth_um, kDepth_um};
  const auto n_along = [](double um) { return static_cast<int>(std::clamp(std::round(um / kPiece_um), 1.0, kMost)); };
  const int n_across = n_along(size.x), n_down = n_along(size.y);
  const Vec2 step{size.x / n_across, size.y / n_down};
  std::vector<Piece> pieces{{low - deep, low}};
  for (int i = 0; i < n_across; ++i)
    pieces.push_back({{low.x + i * step.x, low.y - kDepth_um}, {low.x + (i + 1) * step.x, low.y}});
  pieces.push_back({{high.x, low.y - kDepth_um}, {high.x + kDepth_um, low.y}});
  for (int i = 0; i < n_down; ++i)
    pieces.push_back({{high.x, low.y + i * step.y}, {high.x + kDepth_um, low.y + (i + 1) * step.y}});
  pieces.push_back({high, high + deep});
  for (int i = n_across; i-- > 0;)
    pieces.push_back({{low.x + i * step.x, high.y}, {low.x + (i + 1) * step.x, high.y + kDepth_um}});
  pieces.push_back({{low.x - kDepth_um, high.y}, {low.x, high.y + kDepth_um}});
  for (int i = n_down; i-- > 0;)
    pieces.push_back({{low.x - kDepth_um, low.y + i * step.y}, {low.x, low.y + (i + 1) * step.y}});
  return pieces;
}

/// Discs on a piece, as large as it is wide: what a cell out there does in the field is smooth.
std::vector<substrate::Ellipse> discs_on(const Piece& piece) {
  const Vec2 size = piece.high_um - piece.low_um;
  const double width_um = std::clamp(std::min(size.x, size.y), kPiece_um / 2, kDepth_um);
  const int nx = std::max(1, static_cast<int>(std::lround(size.x / width_um)));
  const int ny = std::max(1, static_cast<int>(std::lround(size.y / width_um)));
  const Vec2 step{size.x / nx, size.y / ny};
  const double radius_um = std::sqrt(step.x * step.y / std::numbers::pi);
  std::vector<substrate::Ellipse> discs;
  for (int j = 0; j < ny; ++j)
    for (int i = 0; i < nx; ++i)
      discs.push_back({.centre_um = piece.low_um + Vec2{(i + 0.5) * step.x, (j + 0.5) * step.y},
                       .semi_major_um = radius_um,
                       .semi_minor_um = radius_um,
                       .angle_rad = 0});
  return discs;
}

}  // namespace

std::vector<Polygon> neighbours_beyond_border(const LinearData& data, const Cell& cell, const Gel& gel) {
  const Extent field = extent_of(data.position_um);
  if (!(field.area_um2() > 0)) return {};
  std::vector<Piece> pieces = pieces_around(field);
  // what lies beyond a cut is allowed for
  std::erase_if(pieces, [&](const Piece& p) {
    return !cuts_of(cell).empty() && distance_to_cut_um(cell, 0.5 * (p.low_um + p.high_um)) < kDepth_um;
  });
  if (pieces.empty()) return {};
  std::vector<substrate::Ellipse> discs;
  std::vector<std::vector<Index>> columns;
  for (const Piece& piece : pieces) {
    const std::vector<substrate::Ellipse> own = discs_on(piece);
    std::vector<Index>& of_piece = columns.emplace_back();
    for (std::size_t k = 0; k < 2 * own.size(); ++k) of_piece.push_back(2 * std::ssize(discs) + static_cast<Index>(k));
    discs.insert(discs.end(), own.begin(), own.end());
  }
  // a layer's tables would take longer than all the rest, and the field of random forces is as smooth
  const auto half_space = greens::make_greens(gel, {.model = substrate::ModelKind::half_space}, data.threads);
  Scores scores =
      pattern_of(data, by_root_of_area(half_space->compliance_um_per_nN(data.position_um, discs), discs)).beyond;
  const double variance = variance_beside(data, scores);
  // Simulated beads without noise: what is left is rounding, and has a shape.
  constexpr double kRounding = 1e-6;  // of the displacement: tables have nine digits, models five and more
  const double mean_square = squared_weights(data).dot(data.displacement_um.cwiseAbs2()) /
                             std::max<double>(1, static_cast<double>(data.n_used));
  if (variance < kRounding * kRounding * mean_square) return {};
  scores.scores /= std::sqrt(variance);
  // half of a likelihood ratio exceeds x by chance less often than exp(-x) (Self & Liang, JASA 82 (1987) 605)
  const std::vector<double> against(columns.size(), std::log(static_cast<double>(columns.size()) / 1e-4));
  std::set<std::size_t> with_next;
  for (const std::size_t k : causes_among(std::move(scores), columns, against))
    for (const std::size_t near : {k, (k + 1) % pieces.size(), (k + pieces.size() - 1) % pieces.size()})
      with_next.insert(near);
  std::vector<Polygon> found;
  for (const std::size_t k : with_next) found.push_back(pieces[k].ring());
  return found;
}

std::vector<std::string> borders_of(const std::vector<Polygon>& pieces_um, const std::vector<Vec2>& beads_um) {
  const auto [low, high] = extent_of(beads_um);
  std::vector<std::string> names;
  for (const Polygon& piece : pieces_um) {
    const Vec2 at = extent_of(piece).middle_um();
    const std::string down = at.y < low.y ? "upper" : at.y > high.y ? "lower" : "";
    const std::string across = at.x < low.x ? "left" : at.x > high.x ? "right" : "";
    const std::string name = down + (down.empty() || across.empty() ? "" : " ") + across;
    if (std::ranges::find(names, name) == names.end()) names.push_back(name);
  }
  return names;
}

}  // namespace mbtfm::tensions
