/// What must hold of each type.
#include <cmath>
#include <set>
#include <string>

#include "pipeline/contract/beads.h"
#include "pipeline/contract/beads_in_space.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/gel.h"
#include "pipeline/contract/network.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/place.h"
#include "pipeline/contract/surface.h"

namespace mbtfm {

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
    require(!a.probability || (*a.probability >= 0 && *a.probability <= 1), "'probability' of " + element,
            "a number from 0 to 1", shown(a.probability.value_or(0)));
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

void check(const std::vector<BeadInSpace>& beads) {
  for (std::size_t i = 0; i < beads.size(); ++i) {
    const BeadInSpace& b = beads[i];
    const bool has_errors = b.sigma_um >= 0 && b.sigma_z_um >= 0 && std::isfinite(b.sigma_um + b.sigma_z_um);
    if (is_finite(b.position_um) && is_finite(b.displacement_um) && has_errors) continue;
    throw InvalidData("bead " + std::to_string(i), "finite numbers, standard errors not below 0", "others");
  }
}

void check(const Gel& gel) {
  require_positive(gel.youngs_modulus_kPa, "youngs_modulus_kPa", "the gel");
  require_positive(gel.thickness_um, "thickness_um", "the gel");
  require(std::isfinite(gel.poisson_ratio) && gel.poisson_ratio >= 0 && gel.poisson_ratio <= 0.5,
          "'poisson_ratio' of the gel", "a number from 0 to 0.5", shown(gel.poisson_ratio));
  if (!gel.surface) return;
  check(*gel.surface);
  const double deepest = std::ranges::max(gel.surface->z_um);
  require(deepest < gel.thickness_um, "the gel's surface",
          "z above the base, which lies thickness_um = " + shown(gel.thickness_um) + " below z = 0",
          "z = " + shown(deepest) + " um");
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

namespace {

const std::string kWithin = "within a metre";

bool is_within(double place_um) { return is_inside(possible_place_um(), place_um); }  // NaN is not
std::string place_or_none(double place_um) {
  return std::isfinite(place_um) ? brief(place_um) + " um" : "NaN or infinity";
}

}  // namespace

void check(const HeightMap& map) {
  constexpr int kFewest = 4;  // a cubic spline's
  const std::string lattice = std::to_string(map.n_x) + " x " + std::to_string(map.n_y) + " vertices";
  require(map.n_x >= kFewest && map.n_y >= kFewest, "height map", "a lattice of at least 4 x 4 vertices", lattice);
  const auto n = static_cast<std::size_t>(map.n_x) * static_cast<std::size_t>(map.n_y);
  require(map.z_um.size() == n, "height map", lattice, std::to_string(map.z_um.size()) + " heights");
  require(map.sigma_um.empty() || map.sigma_um.size() == n, "height map", lattice,
          std::to_string(map.sigma_um.size()) + " standard errors");
  require(is_within(map.origin_um.x) && is_within(map.origin_um.y), "height map", "an origin " + kWithin,
          place_or_none(map.origin_um.x) + ", " + place_or_none(map.origin_um.y));
  require(map.spacing_um.x > 0 && map.spacing_um.y > 0 && is_within(map.n_x * map.spacing_um.x) &&
              is_within(map.n_y * map.spacing_um.y),
          "height map", "positive spacings of a lattice " + kWithin,
          brief(map.spacing_um.x) + ", " + brief(map.spacing_um.y));
  for (std::size_t k = 0; k < n; ++k) {
    const bool has_sigma = map.sigma_um.empty() || (map.sigma_um[k] >= 0 && is_within(map.sigma_um[k]));
    if (is_within(map.z_um[k]) && has_sigma) continue;
    const std::string vertex = "height map, vertex " + std::to_string(k);
    require(is_within(map.z_um[k]), vertex, "a height " + kWithin, place_or_none(map.z_um[k]));
    require(false, vertex, "a standard error of at least 0", brief(map.sigma_um[k]));
  }
}

void check(const TriangleMesh& mesh) {
  for (std::size_t k = 0; k < mesh.points_um.size(); ++k) {
    const Vec3 p = mesh.points_um[k];
    for (const double place : {p.x, p.y, p.z})
      if (!is_within(place))
        throw InvalidData("mesh, point " + std::to_string(k), "coordinates " + kWithin, place_or_none(place));
  }
  const auto n = static_cast<int>(mesh.points_um.size());
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k)
    for (const int corner : mesh.triangles[k])
      if (corner < 0 || corner >= n)
        throw InvalidData("mesh, triangle " + std::to_string(k), "points below " + std::to_string(n),
                          std::to_string(corner));
}

}  // namespace mbtfm
