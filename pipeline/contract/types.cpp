#include "pipeline/contract/types.h"

#include <algorithm>
#include <limits>
#include <numbers>
#include <set>

#include "pipeline/contract/errors.h"

namespace mbtfm {

std::string_view name_of(FibreType type) {
  switch (type) {
    case FibreType::dorsal:
      return "dorsal";
    case FibreType::arc:
      return "arc";
    case FibreType::ventral:
      return "ventral";
    case FibreType::edge:
      return "edge";
  }
  throw InternalError("unknown fibre type");
}

int n_held_ends(FibreType type) { return type == FibreType::arc ? 0 : type == FibreType::dorsal ? 1 : 2; }

std::string_view name_of(AdhesionOrigin origin) {
  switch (origin) {
    case AdhesionOrigin::image:
      return "image";
    case AdhesionOrigin::drawn:
      return "drawn";
    case AdhesionOrigin::anchor:
      return "anchor";
    case AdhesionOrigin::candidate:
      return "candidate";
  }
  throw InternalError("unknown origin of an adhesion");
}

std::optional<AdhesionOrigin> adhesion_origin_of(std::string_view name) {
  for (const AdhesionOrigin origin : kAdhesionOrigins) {
    if (name_of(origin) == name) return origin;
  }
  return std::nullopt;
}

double area_stood_for_um2(const Adhesion& adhesion) {
  // a disc that touches its six neighbours covers pi / sqrt(12) of its cell
  constexpr double kCellOverDisc = 1.1026577908435840990;
  return adhesion.origin == AdhesionOrigin::candidate ? kCellOverDisc * adhesion.area_um2 : adhesion.area_um2;
}

std::optional<FibreType> fibre_type_of(std::string_view name) {
  for (const FibreType type : kFibreTypes) {
    if (name_of(type) == name) return type;
  }
  return std::nullopt;
}

double length_um(const Polyline& points) {
  double length = 0;
  for (std::size_t i = 1; i < points.size(); ++i) length += norm(points[i] - points[i - 1]);
  return length;
}

double nearest_share(Vec2 a, Vec2 b, Vec2 point) {
  const Vec2 step = b - a;
  const double squared = dot(step, step);
  return squared > 0 ? std::clamp(dot(point - a, step) / squared, 0.0, 1.0) : 0.0;
}

double distance_to_segment_um(Vec2 point_um, Vec2 a_um, Vec2 b_um) {
  return norm(point_um - (a_um + nearest_share(a_um, b_um, point_um) * (b_um - a_um)));
}

Polygon ellipse_corners(const Adhesion& adhesion, int n_corners) {
  const Vec2 along{std::cos(adhesion.angle_rad), std::sin(adhesion.angle_rad)};
  const Vec2 across{-along.y, along.x};
  Polygon corners;
  for (int i = 0; i < n_corners; ++i) {
    const double phi = 2 * std::numbers::pi * i / n_corners;
    corners.push_back(adhesion.position_um + 0.5 * adhesion.major_axis_um * std::cos(phi) * along +
                      0.5 * adhesion.minor_axis_um * std::sin(phi) * across);
  }
  return corners;
}

double signed_area_um2(const Polygon& polygon) {
  double doubled = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) doubled += cross(polygon[i], polygon[(i + 1) % polygon.size()]);
  return 0.5 * doubled;
}

bool contains(const Polygon& polygon, Vec2 point) {
  bool is_inside = false;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 a = polygon[i];
    const Vec2 b = polygon[(i + 1) % polygon.size()];
    if ((a.y > point.y) == (b.y > point.y)) continue;
    if (point.x < a.x + (b.x - a.x) * (point.y - a.y) / (b.y - a.y)) is_inside = !is_inside;
  }
  return is_inside;
}

Vec2 nearest_on_boundary_um(const Polygon& polygon, Vec2 point) {
  Vec2 nearest;
  double smallest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 a = polygon[i];
    const Vec2 b = polygon[(i + 1) % polygon.size()];
    const Vec2 candidate = a + nearest_share(a, b, point) * (b - a);
    const Vec2 away = point - candidate;
    if (const double squared = dot(away, away); squared < smallest) {
      smallest = squared;
      nearest = candidate;
    }
  }
  return nearest;
}

double distance_to_boundary_um(const Polygon& polygon, Vec2 point) {
  return norm(point - nearest_on_boundary_um(polygon, point));
}

Cuts cuts_of(const Cell& cell) {
  Cuts cuts;
  const std::size_t n = cell.outline_um.size();
  for (std::size_t i = 0; i < cell.is_cut.size(); ++i) {
    if (cell.is_cut[i]) cuts.emplace_back(cell.outline_um[i], cell.outline_um[(i + 1) % n]);
  }
  return cuts;
}

double distance_to_cut_um(const Cell& cell, Vec2 point) {
  double least = std::numeric_limits<double>::infinity();
  for (const auto& [a, b] : cuts_of(cell)) least = std::min(least, distance_to_segment_um(point, a, b));
  return least;
}

double distance_to_edge_um(const Cell& cell, Vec2 point) {
  double least = distance_to_boundary_um(cell.outline_um, point);
  for (const Polygon& hole : cell.holes_um) least = std::min(least, distance_to_boundary_um(hole, point));
  return least;
}

bool is_held(const Network& network, std::size_t vertex) {
  return network.adhesion_id[vertex] != 0 || (!network.held_by_cut.empty() && network.held_by_cut[vertex]);
}

namespace {

std::string shown(double value) { return "'" + std::to_string(value) + "'"; }

void require(bool holds, const std::string& element, const std::string& expected, const std::string& found) {
  if (!holds) throw InvalidData(element, expected, found);
}

void require_positive(double value, const std::string& name, const std::string& element) {
  require(std::isfinite(value) && value > 0, "'" + name + "' of " + element, "a number > 0", shown(value));
}

void require_finite(Vec2 point, const std::string& element) {
  require(is_finite(point), "position of " + element, "finite numbers", shown(point.x) + ", " + shown(point.y));
}

void require_unique(std::set<int>& seen, int id, const std::string& kind) {
  require(id >= 1, kind + "_id", "an integer >= 1", "'" + std::to_string(id) + "'");
  require(seen.insert(id).second, kind + "_id " + std::to_string(id), "each label once", "it a second time");
}

}  // namespace

void check(const std::vector<Adhesion>& adhesions) {
  std::set<int> seen;
  for (const Adhesion& a : adhesions) {
    require_unique(seen, a.adhesion_id, "adhesion");
    const std::string element = "adhesion " + std::to_string(a.adhesion_id);
    require_finite(a.position_um, element);
    require_positive(a.area_um2, "area_um2", element);
    require_positive(a.major_axis_um, "major_axis_um", element);
    require_positive(a.minor_axis_um, "minor_axis_um", element);
    require(a.minor_axis_um <= a.major_axis_um * (1 + 1e-9), "'minor_axis_um' of " + element,
            "at most major_axis_um = " + shown(a.major_axis_um), shown(a.minor_axis_um));
    require(std::isfinite(a.angle_rad), "'angle_deg' of " + element, "a finite number", shown(a.angle_rad));
    require(!a.edge_distance_um || (std::isfinite(*a.edge_distance_um) && *a.edge_distance_um >= 0),
            "'edge_distance_um' of " + element, "a number >= 0", shown(a.edge_distance_um.value_or(0)));
  }
}

void check(const std::vector<Fibre>& fibres) {
  std::set<int> seen;
  for (const Fibre& f : fibres) {
    require_unique(seen, f.fibre_id, "fibre");
    const std::string element = "fibre " + std::to_string(f.fibre_id);
    require_positive(f.width_um, "width_um", element);
    require(f.points_um.size() >= 2, element, "at least two points", std::to_string(f.points_um.size()));
    for (std::size_t i = 0; i < f.points_um.size(); ++i) {
      require_finite(f.points_um[i], "point " + std::to_string(i) + " of " + element);
      require(i == 0 || !(f.points_um[i] == f.points_um[i - 1]), "point " + std::to_string(i) + " of " + element,
              "another place than the point before", "the same");
    }
  }
}

namespace {

void check_ring(const Polygon& ring, const std::string& element) {
  require(ring.size() >= 3, element, "at least three points", std::to_string(ring.size()));
  for (const Vec2 point : ring) require_finite(point, "a point of the " + element);
  require(std::abs(signed_area_um2(ring)) > 0, element, "an area > 0", "'0'");
}

}  // namespace

void check(const Cell& cell) {
  check(cell.adhesions);
  check(cell.fibres);
  check_ring(cell.outline_um, "outline");
  require(cell.is_cut.empty() || cell.is_cut.size() == cell.outline_um.size(), "is_cut of the outline",
          "one value a point", std::to_string(cell.is_cut.size()));
  for (std::size_t i = 0; i < cell.holes_um.size(); ++i) {
    const std::string element = "ring " + std::to_string(i + 1) + " of the outline";
    check_ring(cell.holes_um[i], element);
    for (const Vec2 point : cell.holes_um[i])
      require(contains(cell.outline_um, point), element, "a hole inside ring 0",
              shown(point.x) + ", " + shown(point.y) + " outside");
  }
  std::set<int> known;
  for (const Adhesion& a : cell.adhesions) known.insert(a.adhesion_id);
  for (const Fibre& f : cell.fibres) {
    for (const auto& end : {f.start_adhesion_id, f.end_adhesion_id}) {
      require(!end || known.contains(*end), "adhesion at an end of fibre " + std::to_string(f.fibre_id),
              "the label of an adhesion", end ? "'" + std::to_string(*end) + "'" : "");
    }
  }
}

void check(const DisplacementField& field) {
  for (std::size_t i = 0; i < field.size(); ++i) {
    const Bead& b = field[i];
    if (is_finite(b.position_um) && is_finite(b.displacement_um) && std::isfinite(b.sigma_um) && b.sigma_um >= 0)
      continue;
    const std::string element = "bead " + std::to_string(i);
    require_finite(b.position_um, element);
    require(is_finite(b.displacement_um), "displacement of " + element, "finite numbers",
            shown(b.displacement_um.x) + ", " + shown(b.displacement_um.y));
    require(false, "'sigma_um' of " + element, "a number >= 0", shown(b.sigma_um));
  }
}

double beads_per_um2(const DisplacementField& beads) {
  if (beads.empty()) return 0;
  Vec2 low = beads.front().position_um, high = low;
  for (const Bead& b : beads) {
    low = {std::min(low.x, b.position_um.x), std::min(low.y, b.position_um.y)};
    high = {std::max(high.x, b.position_um.x), std::max(high.y, b.position_um.y)};
  }
  const double area_um2 = (high.x - low.x) * (high.y - low.y);
  return area_um2 > 0 ? static_cast<double>(beads.size()) / area_um2 : 0;
}

void check(const Gel& gel) {
  require_positive(gel.youngs_modulus_kPa, "youngs_modulus_kPa", "the gel");
  require_positive(gel.thickness_um, "thickness_um", "the gel");
  require(std::isfinite(gel.poisson_ratio) && gel.poisson_ratio >= 0 && gel.poisson_ratio <= 0.5,
          "'poisson_ratio' of the gel", "a number from 0 to 0.5", shown(gel.poisson_ratio));
}

void check(const Network& network) {
  const int n_vertices = static_cast<int>(network.vertices_um.size());
  require(network.adhesion_id.size() == network.vertices_um.size(), "adhesion_id", "one value a vertex",
          std::to_string(network.adhesion_id.size()) + " values for " + std::to_string(n_vertices) + " vertices");
  require(network.held_by_cut.empty() || network.held_by_cut.size() == network.vertices_um.size(), "held_by_cut",
          "one value a vertex", std::to_string(network.held_by_cut.size()));
  for (int v = 0; v < n_vertices; ++v) {
    require_finite(network.vertices_um[v], "vertex " + std::to_string(v));
    require(network.adhesion_id[v] >= 0, "adhesion_id of vertex " + std::to_string(v), "an integer >= 0",
            "'" + std::to_string(network.adhesion_id[v]) + "'");
    require(network.adhesion_id[v] == 0 || network.held_by_cut.empty() || !network.held_by_cut[v],
            "vertex " + std::to_string(v), "an adhesion or the cut that holds it", "both");
  }
  for (std::size_t k = 0; k < network.links.size(); ++k) {
    const Link& link = network.links[k];
    const std::string element = "link " + std::to_string(k);
    for (const int end : {link.vertex_a, link.vertex_b}) {
      require(end >= 0 && end < n_vertices, "an end of " + element, "a vertex below " + std::to_string(n_vertices),
              "'" + std::to_string(end) + "'");
    }
    require(link.vertex_a != link.vertex_b, element, "two different vertices",
            "vertex " + std::to_string(link.vertex_a) + " twice");
    require(link.fibre_id >= 0, "'fibre_id' of " + element, "an integer >= 0",
            "'" + std::to_string(link.fibre_id) + "'");
    require_positive(link.rest_length_um, "rest_length_um", element);
    require_positive(link.share, "share", element);
  }
}

}  // namespace mbtfm
