/// The tractions that are looked for in space: vectors at the vertices of quads on the gel's surface, bilinear between
/// them. A space of its own: the answer must not depend on the mesh that solves for the displacement.
#pragma once

#include <Eigen/Core>
#include <Eigen/SparseCore>
#include <cmath>
#include <compare>
#include <functional>
#include <memory>
#include <span>
#include <utility>
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

// Tractions as sums of shapes.

/// t = L x for each component: L has a row for each vertex, x a number for each shape and component (all of x, then
/// those of y, then of z). Tractions are by vertex: x, y, z of each in turn.
class Basis {
 public:
  explicit Basis(Eigen::MatrixXd shapes) : shapes_(std::move(shapes)) {}

  const Eigen::MatrixXd& shapes() const { return shapes_; }
  Eigen::Index size() const { return shapes_.cols(); }
  /// G L, where u = G t.
  Eigen::MatrixXd response(const Eigen::MatrixXd& by_traction, int threads) const;
  Eigen::VectorXd tractions(const Eigen::VectorXd& x) const;
  /// Lᵀ of numbers by vertex.
  Eigen::VectorXd transposed(const Eigen::VectorXd& by_vertex) const;
  /// L C Lᵀ, by vertex
  Eigen::MatrixXd covariance(const Eigen::MatrixXd& of_x, int threads) const;

 private:
  Eigen::MatrixXd shapes_;
};

/// ∫ φ φᵀ / a² dA with the shape functions φ of the vertices and the amplitude a that is expected of a place.
Eigen::MatrixXd norm_of(const TractionMesh& mesh, const Ground& ground, const std::function<double(Vec2)>& amplitude);

/// L = R⁻¹, RᵀR the norm: |x|² = ∫ |t|²/a² dA, whatever the mesh.
Basis orthonormal_basis(Eigen::MatrixXd norm_um2);

/// Spots: each is a Gaussian of the distance in space, weighed by area so that an x of one on all of them is a traction
/// of one everywhere; and scaled so that |x|² is the integral of the squares of what was smoothed.
/// @param width_um  standard deviation
Basis spot_basis(const TractionMesh& mesh, const Ground& ground, double width_um);

/// The width of spots that beads at this distance resolve.
double spot_width_um(double bead_distance_um);

}  // namespace mbtfm::spatial
