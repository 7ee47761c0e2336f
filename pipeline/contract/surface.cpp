#include "pipeline/contract/surface.h"

#include <cmath>
#include <string>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/place.h"

namespace mbtfm {

namespace {

const std::string kWithin = "within a metre";

bool is_within(double place_um) { return is_inside(possible_place_um(), place_um); }  // NaN is not
std::string told(double place_um) { return std::isfinite(place_um) ? brief(place_um) + " um" : "NaN or infinity"; }

}  // namespace

void check(const HeightMap& map) {
  constexpr int kFewest = 4;  // a cubic spline's
  const auto lattice = [&] { return std::to_string(map.n_x) + " x " + std::to_string(map.n_y) + " vertices"; };
  if (map.n_x < kFewest || map.n_y < kFewest)
    throw InvalidData("height map", "a lattice of at least 4 x 4 vertices", lattice());
  const auto n = static_cast<std::size_t>(map.n_x) * static_cast<std::size_t>(map.n_y);
  if (map.z_um.size() != n) throw InvalidData("height map", lattice(), std::to_string(map.z_um.size()) + " heights");
  if (!map.sigma_um.empty() && map.sigma_um.size() != n)
    throw InvalidData("height map", lattice(), std::to_string(map.sigma_um.size()) + " standard errors");
  if (!is_within(map.origin_um.x) || !is_within(map.origin_um.y))
    throw InvalidData("height map", "an origin " + kWithin, told(map.origin_um.x) + ", " + told(map.origin_um.y));
  if (!(map.spacing_um.x > 0 && map.spacing_um.y > 0 && is_within(map.n_x * map.spacing_um.x) &&
        is_within(map.n_y * map.spacing_um.y)))
    throw InvalidData("height map", "positive spacings of a lattice " + kWithin,
                      brief(map.spacing_um.x) + ", " + brief(map.spacing_um.y));
  for (std::size_t k = 0; k < n; ++k) {
    const std::string vertex = "height map, vertex " + std::to_string(k);
    if (!is_within(map.z_um[k])) throw InvalidData(vertex, "a height " + kWithin, told(map.z_um[k]));
    if (map.sigma_um.empty()) continue;
    if (!(map.sigma_um[k] >= 0 && is_within(map.sigma_um[k])))
      throw InvalidData(vertex, "a standard error of at least 0", brief(map.sigma_um[k]));
  }
}

void check(const TriangleMesh& mesh) {
  for (std::size_t k = 0; k < mesh.points_um.size(); ++k) {
    const Vec3 p = mesh.points_um[k];
    for (const double place : {p.x, p.y, p.z})
      if (!is_within(place))
        throw InvalidData("mesh, point " + std::to_string(k), "coordinates " + kWithin, told(place));
  }
  const auto n = static_cast<int>(mesh.points_um.size());
  for (std::size_t k = 0; k < mesh.triangles.size(); ++k) {
    for (const int corner : mesh.triangles[k]) {
      if (corner >= 0 && corner < n) continue;
      throw InvalidData("mesh, triangle " + std::to_string(k), "points below " + std::to_string(n),
                        std::to_string(corner));
    }
  }
}

}  // namespace mbtfm
