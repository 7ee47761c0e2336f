#include "pipeline/contract/surface.h"

#include <cmath>
#include <string>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm {

void check(const HeightMap& map) {
  constexpr int kFewest = 4;  // a cubic spline's
  const auto lattice = [&] { return std::to_string(map.n_x) + " x " + std::to_string(map.n_y) + " vertices"; };
  if (map.n_x < kFewest || map.n_y < kFewest)
    throw InvalidData("height map", "a lattice of at least 4 x 4 vertices", lattice());
  const auto n = static_cast<std::size_t>(map.n_x) * static_cast<std::size_t>(map.n_y);
  if (map.z_um.size() != n) throw InvalidData("height map", lattice(), std::to_string(map.z_um.size()) + " heights");
  if (!map.sigma_um.empty() && map.sigma_um.size() != n)
    throw InvalidData("height map", lattice(), std::to_string(map.sigma_um.size()) + " standard errors");
  if (!is_finite(map.origin_um)) throw InvalidData("height map", "a finite origin", "NaN or infinity");
  if (!(map.spacing_um.x > 0 && map.spacing_um.y > 0 && is_finite(map.spacing_um)))
    throw InvalidData("height map", "positive spacings", brief(map.spacing_um.x) + ", " + brief(map.spacing_um.y));
  for (std::size_t k = 0; k < n; ++k) {
    const std::string vertex = "height map, vertex " + std::to_string(k);
    if (!std::isfinite(map.z_um[k])) throw InvalidData(vertex, "a finite height", "NaN or infinity");
    if (map.sigma_um.empty()) continue;
    if (!(map.sigma_um[k] >= 0 && std::isfinite(map.sigma_um[k])))
      throw InvalidData(vertex, "a standard error of at least 0", brief(map.sigma_um[k]));
  }
}

void check(const TriangleMesh& mesh) {
  for (std::size_t k = 0; k < mesh.points_um.size(); ++k) {
    if (!is_finite(mesh.points_um[k]))
      throw InvalidData("mesh, point " + std::to_string(k), "finite coordinates", "NaN or infinity");
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
