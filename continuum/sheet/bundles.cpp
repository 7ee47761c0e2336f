#include "continuum/sheet/bundles.h"

#include <algorithm>

#include "pipeline/contract/errors.h"

namespace mbtfm::sheet {
namespace {

constexpr double kBeside = 0.3;  // of a triangle: fibres are drawn up to the outline, triangles end near it

}  // namespace

std::vector<Bundle> within(const Elements& elements, const std::vector<Bundle>& bundles) {
  const Locator locator(elements);
  std::vector<Bundle> inside;
  for (const Bundle& bundle : bundles) {
    const auto is_outside = [&](Vec2 p) { return !locator.find(p, kBeside); };
    Polyline points = bundle.points_um;
    while (!points.empty() && is_outside(points.back())) points.pop_back();
    const auto first = std::ranges::find_if_not(points, is_outside);
    points.erase(points.begin(), first);
    const std::string name = "fibre " + std::to_string(bundle.fibre_id);
    if (points.size() < 2) throw InvalidData(name, "two points in the sheet or more", std::to_string(points.size()));
    if (std::ranges::any_of(points, is_outside)) throw InvalidData(name, "a line in the sheet", "one that leaves it");
    inside.push_back({bundle.fibre_id, std::move(points)});
  }
  return inside;
}

NodeVectors forces_of_bundle_nN(const Elements& elements, const Bundle& bundle) {
  const Locator locator(elements);
  NodeVectors forces = NodeVectors::Zero(2 * elements.n_nodes());
  const auto push = [&](Vec2 at, Vec2 force) {
    const auto place = locator.find(at, kBeside);
    MBTFM_ASSERT(place.has_value());
    const Shape shape = elements.shape(place->triangle, place->r, place->s);
    for (std::size_t i = 0; i < 6; ++i) {
      const int node = elements.nodes(place->triangle)[i];
      forces(2 * node) += shape.value[i] * force.x;
      forces(2 * node + 1) += shape.value[i] * force.y;
    }
  };
  const Polyline& points = bundle.points_um;
  for (std::size_t k = 0; k + 1 < points.size(); ++k) {
    const Vec2 piece = points[k + 1] - points[k], along = 1 / norm(piece) * piece;
    push(points[k], along);
    push(points[k + 1], -1.0 * along);
  }
  return forces;
}

}  // namespace mbtfm::sheet
