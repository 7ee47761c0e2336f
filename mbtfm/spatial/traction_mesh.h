/// The tractions that are looked for in space: vectors at the vertices of a lattice on the gel's surface, bilinear
/// between them. A space of its own: the answer must not depend on the mesh that solves for the displacement.
#pragma once

#include <Eigen/SparseCore>
#include <functional>
#include <memory>
#include <vector>

#include "substrate/loads.h"
#include "substrate/surface/height.h"

namespace mbtfm::spatial {

/// The gel's surface; flat at z = 0 where no map is given.
class Ground {
 public:
  explicit Ground(const HeightMap* map);
  double height_um(Vec2 at_um) const { return height_ ? (*height_)(at_um) : 0; }
  /// A surface that is not flat is known where the map is.
  bool knows(Vec2 at_um) const;
  /// Out of the gel, of length 1.
  Vec3 normal(Vec2 at_um) const;
  /// Of the surface over the area that it covers seen from above.
  double stretch(Vec2 at_um) const;
  const surface::Height* map() const { return height_.get(); }

 private:
  std::shared_ptr<const surface::Height> height_;
};

/// Seen from above.
struct Rectangle {
  Vec2 low_um, high_um;
};

struct TractionMesh {
  substrate::SurfaceMesh quads;
  std::vector<double> areas_um2;         ///< by vertex: the integral of its shape function over the curved surface
  Eigen::SparseMatrix<double> mass_um2;  ///< integrals of the products of two
  std::vector<Vec2> low_corners_um;      ///< by face
  Vec2 spacing_um;

  int n_vertices() const { return static_cast<int>(quads.points_um.size()); }
};

/// @param spacing_um  made smaller so that faces fill the rectangle
/// @param carries     whether the face around a place carries tractions
/// @throws InvalidData where no face does
TractionMesh make_traction_mesh(const Ground& ground, const Rectangle& over, double spacing_um,
                                const std::function<bool(Vec2)>& carries);

/// Calls use(place, shares of the four vertices of the face, area) at n × n places of each face: the midpoints of even
/// parts, or Gauss points.
enum class Places { even, gauss };
void over_faces(const TractionMesh& mesh, const Ground& ground, int n, Places places,
                const std::function<void(Vec2 at_um, const std::array<int, 4>& vertices,
                                         const std::array<double, 4>& shares, double area_um2)>& use);

}  // namespace mbtfm::spatial
