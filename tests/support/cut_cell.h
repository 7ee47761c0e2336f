/// A simulated cell seen through a smaller image than it: what is left of the segmentation, and what is not seen.
#pragma once

#include "mbtfm/tensions/beyond_cut.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/ensemble.h"
#include "network/cables/cables.h"
#include "network/mesh/mesh.h"
#include "segment/cells/ellipse.h"
#include "segment/cells/outline.h"
#include "substrate/greens/models.h"
#include "substrate/loads.h"
#include "tests/support/test.h"

namespace mbtfm::test {

struct Window {
  Vec2 low_um, high_um;
  bool contains(Vec2 p) const { return p.x >= low_um.x && p.y >= low_um.y && p.x <= high_um.x && p.y <= high_um.y; }
};

/// Sutherland & Hodgman (1974).
inline Polygon clipped(Polygon polygon, const Window& window) {
  const std::array<std::pair<Vec2, Vec2>, 4> sides = {
      {{window.low_um, {1, 0}}, {window.low_um, {0, 1}}, {window.high_um, {-1, 0}}, {window.high_um, {0, -1}}}};
  for (const auto& [at, inward] : sides) {
    Polygon kept;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec2 a = polygon[i], b = polygon[(i + 1) % polygon.size()];
      const double from = dot(a - at, inward), to = dot(b - at, inward);
      if (from >= 0) kept.push_back(a);
      if ((from > 0 && to < 0) || (from < 0 && to > 0)) kept.push_back(a + (from / (from - to)) * (b - a));
    }
    polygon = std::move(kept);
  }
  return polygon;
}

/// The longest part of a line inside.
inline Polyline clipped_line(const Polyline& line, const Window& window) {
  Polyline dense{line.front()}, part, longest;
  for (std::size_t i = 1; i < line.size(); ++i) {
    const int n = std::max(1, static_cast<int>(norm(line[i] - line[i - 1]) / 0.01));
    for (int k = 1; k <= n; ++k) dense.push_back(line[i - 1] + (double(k) / n) * (line[i] - line[i - 1]));
  }
  const auto end_part = [&] {
    if (part.size() > 1 && (longest.empty() || length_um(part) > length_um(longest))) longest = part;
    part.clear();
  };
  const auto onto = [&](Vec2 p) {  // 0.01 um beyond the border at most
    return Vec2{std::clamp(p.x, window.low_um.x, window.high_um.x), std::clamp(p.y, window.low_um.y, window.high_um.y)};
  };
  for (std::size_t i = 0; i < dense.size(); ++i) {
    const bool is_in = window.contains(dense[i]);
    if (!is_in && !part.empty()) part.push_back(onto(dense[i])), end_part();
    if (is_in && part.empty() && i > 0) part.push_back(onto(dense[i - 1]));
    if (is_in && (part.empty() || !(part.back() == dense[i]))) part.push_back(dense[i]);
  }
  end_part();
  return longest;
}

struct CutCell {
  Cell cell;
  std::map<int, double> share_inside;  ///< by adhesion of the cell: of its area
  Vec2 outside_nN;                     ///< sum of the adhesions' forces out there: what passes through the cut
};

inline CutCell cut_cell(const Cell& whole, const std::vector<AdhesionForce>& forces, const Window& window) {
  constexpr double kSmallest_um2 = 0.05;  // less of an adhesion nobody segments
  constexpr double kShortest_um = 3;      // segment.fibre_shortest_um
  CutCell cut;
  const Polygon ring = clipped(whole.outline_um, window);
  // the border is the image's where the window's is: shifted, so that it begins at the origin
  Polygon shifted;
  for (const Vec2 p : ring) shifted.push_back(p - window.low_um);
  const cells::CutRing marked = cells::cut_by_border(shifted, window.high_um - window.low_um, 1e-6);
  for (const Vec2 p : marked.points_um) cut.cell.outline_um.push_back(p + window.low_um);
  cut.cell.is_cut = marked.is_cut;
  for (const Adhesion& a : whole.adhesions) {
    Polygon part = clipped(ellipse_corners(a, 64), window);
    const double area_um2 = part.size() < 3 ? 0 : std::abs(signed_area_um2(part));
    const double share = std::min(1.0, area_um2 / std::abs(signed_area_um2(ellipse_corners(a, 64))));
    const auto force = std::ranges::find(forces, a.adhesion_id, &AdhesionForce::adhesion_id);
    cut.outside_nN += (1 - (area_um2 >= kSmallest_um2 ? share : 0)) * force->force_nN;
    if (area_um2 < kSmallest_um2) continue;
    Adhesion seen = share < 1 ? cells::ellipse_of_polygon(part) : a;
    seen.adhesion_id = a.adhesion_id;
    cut.share_inside[a.adhesion_id] = share;
    cut.cell.adhesions.push_back(seen);
  }
  for (Fibre f : whole.fibres) {
    const Polyline line = clipped_line(f.points_um, window);
    if (line.empty() || length_um(line) < kShortest_um) continue;
    const auto keeps = [&](Vec2 end, std::optional<int> id) {
      return id && cut.share_inside.contains(*id) && window.contains(end) ? id : std::nullopt;
    };
    f.start_adhesion_id =
        norm(line.front() - f.points_um.front()) < 0.02 ? keeps(line.front(), f.start_adhesion_id) : std::nullopt;
    f.end_adhesion_id =
        norm(line.back() - f.points_um.back()) < 0.02 ? keeps(line.back(), f.end_adhesion_id) : std::nullopt;
    f.points_um = line;
    cut.cell.fibres.push_back(f);
  }
  return cut;
}

inline DisplacementField beads_in(const DisplacementField& beads, const Window& window) {
  DisplacementField inside;
  for (const Bead& b : beads)
    if (window.contains(b.position_um)) inside.push_back(b);
  return inside;
}

struct CutFit {
  tensions::EnsembleFit fit;
  std::optional<tensions::ForcesBeyond> beyond;
  std::optional<tensions::FoundMotion> motion;
};

enum class Beyond { allowed, ignored };

inline CutFit fit_cut(const Cell& cell, const DisplacementField& beads, const Gel& gel, int n_meshes,
                      Beyond allow = Beyond::allowed, const tensions::BeyondSpacing& spacing = {}) {
  std::vector<Vec2> points;
  for (const Bead& bead : beads) points.push_back(bead.position_um);
  std::vector<substrate::Ellipse> ellipses;
  std::vector<int> ids;
  for (const Adhesion& a : cell.adhesions) {
    ellipses.push_back(substrate::ellipse_of(a));
    ids.push_back(a.adhesion_id);
  }
  tensions::LinearData data = tensions::reduce(
      beads,
      greens::make_greens(gel, {.model = substrate::ModelKind::layer}, 2)->response({ellipses}, {points})->kept(), {},
      2, tensions::affine_motions(beads));
  CutFit result;
  if (allow == Beyond::allowed && !cuts_of(cell).empty()) {
    tensions::DataWithBeyond allowed = tensions::with_forces_beyond(std::move(data), cell, gel, spacing);
    data = std::move(allowed.data);
    result.beyond = allowed.beyond;
  }
  std::vector<cables::CableNetwork> networks;
  mesh::NetworkParameters p;
  for (int m = 0; m < n_meshes; ++m) {
    p.seed = static_cast<std::uint64_t>(m) + 1;
    networks.emplace_back(mesh::generate_network(cell, p).network);
  }
  tensions::FitParameters parameters;
  parameters.n_meshes = n_meshes;
  result.fit = tensions::fit_ensemble(networks, std::move(data), ids, parameters, 2);
  result.motion = tensions::common_motion_among(tensions::motions_beside(result.fit.data, result.fit), result.fit.data);
  return result;
}

}  // namespace mbtfm::test
