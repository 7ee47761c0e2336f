#include "continuum/sheet/cut_edge.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::sheet {
namespace {

/// Along which axis a cut holds the sheet if it is held across.
std::size_t axis_across(const std::pair<Vec2, Vec2>& cut) {
  constexpr double kAslant = 1e-3;  // of its length: coordinates are written with some digits
  const Vec2 along = cut.second - cut.first;
  if (std::min(std::abs(along.x), std::abs(along.y)) > kAslant * norm(along))
    throw InvalidData("the outline's cut from (" + brief(cut.first.x) + ", " + brief(cut.first.y) + ") um",
                      "a piece along x or y, as the image's border runs",
                      "one to (" + brief(cut.second.x) + ", " + brief(cut.second.y) + ") um");
  return std::abs(along.x) > std::abs(along.y) ? 1 : 0;
}

}  // namespace

CutHold hold_at_cuts(const Elements& elements, const Region& region, CutEdge edge) {
  CutHold hold;
  if (region.cuts.empty() || edge == CutEdge::free) return hold;
  constexpr double kBeside =
      0.05;  // of a side: curves through the outline's points are rounded where it turns a little
  const std::vector<Vec2>& x = elements.triangles().nodes_um;
  hold.held.assign(x.size(), {false, false});
  for (const Triangles::Side& side : elements.triangles().sides) {
    if (side.curve >= std::ssize(region.rims)) continue;
    const double length = norm(x[side.nodes[1]] - x[side.nodes[0]]);
    const auto nearest = [&](int node) {
      return std::ranges::min_element(
          region.cuts, {}, [&](const auto& cut) { return distance_to_segment_um(x[node], cut.first, cut.second); });
    };
    const bool is_cut = std::ranges::all_of(side.nodes, [&](int node) {
      const auto cut = nearest(node);
      return distance_to_segment_um(x[node], cut->first, cut->second) < kBeside * length;
    });
    if (!is_cut) continue;
    hold.length_um += length;
    const std::size_t across = axis_across(*nearest(side.nodes[2]));
    for (std::size_t axis = 0; axis < 2; ++axis) {
      if (axis != across && edge == CutEdge::held) continue;
      hold.holds[axis] = true;
      for (const int node : side.nodes) hold.held[node][axis] = true;
    }
  }
  return hold;
}

}  // namespace mbtfm::sheet
