/// The tractions that are looked for in space: vectors at the vertices of quads on the gel's surface, bilinear between
/// them. A space of its own: the answer must not depend on the mesh that solves for the displacement.
#pragma once

#include <Eigen/SparseCore>
#include <cmath>
#include <compare>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "pipeline/contract/extent.h"
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
using Rectangle = Extent;

/// A face of the quadtree: of level n its sides are those of the coarsest lattice, halved n times.
struct Leaf {
  int level = 0, column = 0, row = 0;
  auto operator<=>(const Leaf&) const = default;
};

/// A lattice whose faces may be split in four, so that neighbours along a side differ by one level at most. A vertex
/// in the middle of a larger face's side hangs: its traction is the mean of that side's ends, so that tractions are
/// continuous. All numbers by vertex are of the free ones, which come first.
struct TractionMesh {
  substrate::SurfaceMesh quads;                             ///< of all vertices
  Eigen::SparseMatrix<double, Eigen::RowMajor> constraint;  ///< all vertices x free ones
  std::vector<double> areas_um2;         ///< by free vertex: the integral of its shape function over the curved surface
  Eigen::SparseMatrix<double> mass_um2;  ///< integrals of the products of two
  std::vector<Leaf> leaves;              ///< by face
  Vec2 low_um, spacing_um;               ///< of the coarsest lattice

  int n_vertices() const { return static_cast<int>(constraint.cols()); }
  Vec2 size_um(const Leaf& leaf) const { return std::ldexp(1, -leaf.level) * spacing_um; }
  Vec2 low_corner_um(const Leaf& leaf) const;
  int finest_level() const;
};

/// A lattice of one level.
/// @param spacing_um  made smaller so that faces fill the rectangle
/// @param carries     whether the face around a place carries tractions
/// @throws InvalidData where no face does
TractionMesh make_traction_mesh(const Ground& ground, const Rectangle& over, double spacing_um,
                                const std::function<bool(Vec2)>& carries);

/// The same with some faces split in four, and those of their neighbours that would differ by two levels.
TractionMesh with_split(const TractionMesh& mesh, const Ground& ground, const std::vector<bool>& is_split);

/// The same surface as a lattice of its smallest faces.
TractionMesh evened(TractionMesh mesh, const Ground& ground);

struct VertexShare {
  int vertex = 0;
  double share = 0;
};

std::vector<VertexShare> shares_of(const TractionMesh& mesh, int vertex);
/// The shape functions at a place; none where no face is.
std::vector<VertexShare> shares_at(const TractionMesh& mesh, Vec2 at_um);

/// Calls use(place, shares of the free vertices, area) at n × n places of each face: the midpoints of even parts, or
/// Gauss points.
enum class Places { even, gauss };
void over_faces(const TractionMesh& mesh, const Ground& ground, int n, Places places,
                const std::function<void(Vec2 at_um, std::span<const VertexShare> shares, double area_um2)>& use);

}  // namespace mbtfm::spatial
