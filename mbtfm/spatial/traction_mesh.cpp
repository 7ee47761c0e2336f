#include "mbtfm/spatial/traction_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/quadrature.h"

namespace mbtfm::spatial {

Ground::Ground(const HeightMap* map) : height_(map ? std::make_shared<const surface::Height>(*map) : nullptr) {}

bool Ground::knows(Vec2 at_um) const { return !height_ || height_->contains(at_um); }

Vec3 Ground::normal(Vec2 at_um) const {
  if (!height_) return {0, 0, -1};
  const Vec2 slope = height_->slope(at_um);
  return 1 / std::sqrt(1 + dot(slope, slope)) * Vec3{slope.x, slope.y, -1};
}

double Ground::stretch(Vec2 at_um) const {
  if (!height_) return 1;
  const Vec2 slope = height_->slope(at_um);
  return std::sqrt(1 + dot(slope, slope));
}

TractionMesh make_traction_mesh(const Ground& ground, const Rectangle& over, double spacing_um,
                                const std::function<bool(Vec2)>& carries) {
  const Vec2 size = over.high_um - over.low_um;
  MBTFM_ASSERT(size.x > 0 && size.y > 0 && spacing_um > 0);
  const int n_x = std::max(1, static_cast<int>(std::ceil(size.x / spacing_um - 1e-9)));
  const int n_y = std::max(1, static_cast<int>(std::ceil(size.y / spacing_um - 1e-9)));
  TractionMesh mesh;
  mesh.spacing_um = {size.x / n_x, size.y / n_y};
  std::map<std::array<int, 2>, int> vertex_at;
  const auto vertex = [&](int column, int row) {
    const auto [found, is_new] = vertex_at.emplace(std::array{column, row}, mesh.n_vertices());
    if (is_new) mesh.quads.points_um.push_back(over.low_um + Vec2{column * mesh.spacing_um.x, row * mesh.spacing_um.y});
    return found->second;
  };
  for (int row = 0; row < n_y; ++row) {
    for (int column = 0; column < n_x; ++column) {
      const Vec2 low = over.low_um + Vec2{column * mesh.spacing_um.x, row * mesh.spacing_um.y};
      if (!carries(low + 0.5 * mesh.spacing_um)) continue;
      mesh.quads.faces.push_back(
          {vertex(column, row), vertex(column + 1, row), vertex(column + 1, row + 1), vertex(column, row + 1)});
      mesh.low_corners_um.push_back(low);
    }
  }
  if (mesh.quads.faces.empty()) {
    throw InvalidData("the region of tractions", "a part of the field of the beads",
                      "none of the lattice's faces of " + brief(mesh.spacing_um.x) + " um lies in it");
  }
  mesh.areas_um2.assign(mesh.quads.points_um.size(), 0);
  std::vector<Eigen::Triplet<double>> mass;
  over_faces(mesh, ground, 4, Places::gauss,
             [&](Vec2, const std::array<int, 4>& vertices, const std::array<double, 4>& shares, double area_um2) {
               for (int i = 0; i < 4; ++i) {
                 mesh.areas_um2[vertices[i]] += shares[i] * area_um2;
                 for (int j = 0; j < 4; ++j)
                   mass.emplace_back(vertices[i], vertices[j], shares[i] * shares[j] * area_um2);
               }
             });
  mesh.mass_um2.resize(mesh.n_vertices(), mesh.n_vertices());
  mesh.mass_um2.setFromTriplets(mass.begin(), mass.end());
  return mesh;
}

void over_faces(const TractionMesh& mesh, const Ground& ground, int n, Places places,
                const std::function<void(Vec2 at_um, const std::array<int, 4>& vertices,
                                         const std::array<double, 4>& shares, double area_um2)>& use) {
  std::vector<double> at, weight;
  if (places == Places::gauss) {
    const numerics::GaussRule gauss = numerics::gauss_legendre(n);
    for (int k = 0; k < n; ++k) {
      at.push_back(0.5 * (1 + gauss.nodes[k]));
      weight.push_back(0.5 * gauss.weights[k]);
    }
  } else {
    for (int k = 0; k < n; ++k) {
      at.push_back((k + 0.5) / n);
      weight.push_back(1.0 / n);
    }
  }
  const double face_um2 = mesh.spacing_um.x * mesh.spacing_um.y;
  for (std::size_t f = 0; f < mesh.quads.faces.size(); ++f) {
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const double x = at[i], y = at[j];
        const Vec2 place = mesh.low_corners_um[f] + Vec2{x * mesh.spacing_um.x, y * mesh.spacing_um.y};
        use(place, mesh.quads.faces[f], {(1 - x) * (1 - y), x * (1 - y), x * y, (1 - x) * y},
            weight[i] * weight[j] * face_um2 * ground.stretch(place));
      }
    }
  }
}

}  // namespace mbtfm::spatial
