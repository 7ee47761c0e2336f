#include "mbtfm/spatial/traction_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/dense.h"
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

namespace {

/// In units of faces of the finest level that there may be.
constexpr int kMostLevels = 12;
using Place = std::array<int, 2>;

Place place_of(const Leaf& leaf, int right, int down) {
  const int unit = 1 << (kMostLevels - leaf.level);
  return {(leaf.column + right) * unit, (leaf.row + down) * unit};
}

/// Right, down: of the corners in the order of a quad.
constexpr std::array<Place, 4> kCorners = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};

std::array<Leaf, 4> children_of(const Leaf& leaf) {
  std::array<Leaf, 4> children;
  for (std::size_t k = 0; k < 4; ++k)
    children[k] = {leaf.level + 1, 2 * leaf.column + static_cast<int>(k % 2), 2 * leaf.row + static_cast<int>(k / 2)};
  return children;
}

Leaf parent_of(const Leaf& leaf) { return {leaf.level - 1, leaf.column >> 1, leaf.row >> 1}; }

class Quadtree {
 public:
  explicit Quadtree(const std::vector<Leaf>& leaves) : leaves_(leaves.begin(), leaves.end()) {}

  void split(const Leaf& leaf) {
    if (!leaves_.erase(leaf)) return;  // as a neighbour already
    MBTFM_ASSERT(leaf.level < kMostLevels);
    for (const Leaf& child : children_of(leaf)) leaves_.insert(child);
    for (const Place step : {Place{-1, 0}, Place{1, 0}, Place{0, -1}, Place{0, 1}}) {
      if (leaf.level == 0) break;
      const Leaf larger = parent_of({leaf.level, leaf.column + step[0], leaf.row + step[1]});
      if (leaves_.contains(larger)) split(larger);
    }
  }
  /// From left to right, row by row of the coarsest lattice.
  std::vector<Leaf> in_order(const std::vector<Leaf>& before) const {
    std::vector<Leaf> leaves;
    const std::function<void(const Leaf&)> add = [&](const Leaf& leaf) {
      if (leaves_.contains(leaf)) return leaves.push_back(leaf);
      for (const Leaf& child : children_of(leaf)) add(child);
    };
    for (const Leaf& leaf : before) add(leaf);
    return leaves;
  }

 private:
  std::set<Leaf> leaves_;
};

/// The ends of the side in whose middle a vertex hangs.
std::map<Place, std::array<Place, 2>> hanging_places(const std::vector<Leaf>& leaves,
                                                     const std::map<Place, int>& vertices) {
  std::map<Place, std::array<Place, 2>> hanging;
  for (const Leaf& leaf : leaves) {
    for (std::size_t k = 0; k < 4; ++k) {
      const Place a = place_of(leaf, kCorners[k][0], kCorners[k][1]);
      const Place b = place_of(leaf, kCorners[(k + 1) % 4][0], kCorners[(k + 1) % 4][1]);
      const Place middle = {(a[0] + b[0]) / 2, (a[1] + b[1]) / 2};
      if (vertices.contains(middle)) hanging[middle] = {a, b};
    }
  }
  return hanging;
}

/// Vertices, faces and constraint of the leaves.
void number_vertices(TractionMesh& mesh) {
  std::map<Place, int> vertices;
  std::vector<Place> met;
  for (const Leaf& leaf : mesh.leaves) {
    for (const Place& corner : kCorners) {
      const Place place = place_of(leaf, corner[0], corner[1]);
      if (vertices.emplace(place, 0).second) met.push_back(place);
    }
  }
  const auto hanging = hanging_places(mesh.leaves, vertices);
  std::ranges::stable_partition(met, [&](const Place& p) { return !hanging.contains(p); });
  for (std::size_t v = 0; v < met.size(); ++v) {
    vertices[met[v]] = static_cast<int>(v);
    const double unit = std::ldexp(1, -kMostLevels);
    mesh.quads.points_um.push_back(
        mesh.low_um + Vec2{met[v][0] * (unit * mesh.spacing_um.x), met[v][1] * (unit * mesh.spacing_um.y)});
  }
  for (const Leaf& leaf : mesh.leaves) {
    std::array<int, 4>& face = mesh.quads.faces.emplace_back();
    for (std::size_t k = 0; k < 4; ++k) face[k] = vertices[place_of(leaf, kCorners[k][0], kCorners[k][1])];
  }
  const auto n_free = static_cast<int>(met.size() - hanging.size());
  std::vector<Eigen::Triplet<double>> shares;
  // an end may hang on a larger face in turn
  const std::function<void(int, const Place&, double)> add = [&](int row, const Place& place, double share) {
    const auto found = hanging.find(place);
    if (found == hanging.end()) return static_cast<void>(shares.emplace_back(row, vertices[place], share));
    for (const Place& end : found->second) add(row, end, 0.5 * share);
  };
  for (std::size_t v = 0; v < met.size(); ++v) add(static_cast<int>(v), met[v], 1);
  mesh.constraint.resize(static_cast<Eigen::Index>(met.size()), n_free);
  mesh.constraint.setFromTriplets(shares.begin(), shares.end());
}

TractionMesh mesh_of(std::vector<Leaf> leaves, Vec2 low_um, Vec2 spacing_um, const Ground& ground) {
  TractionMesh mesh;
  mesh.leaves = std::move(leaves);
  mesh.low_um = low_um;
  mesh.spacing_um = spacing_um;
  number_vertices(mesh);
  mesh.areas_um2.assign(static_cast<std::size_t>(mesh.n_vertices()), 0);
  std::vector<Eigen::Triplet<double>> mass;
  over_faces(mesh, ground, 4, Places::gauss, [&](Vec2, std::span<const VertexShare> shares, double area_um2) {
    for (const VertexShare& a : shares) {
      mesh.areas_um2[a.vertex] += a.share * area_um2;
      for (const VertexShare& b : shares) mass.emplace_back(a.vertex, b.vertex, a.share * b.share * area_um2);
    }
  });
  mesh.mass_um2.resize(mesh.n_vertices(), mesh.n_vertices());
  mesh.mass_um2.setFromTriplets(mass.begin(), mass.end());
  return mesh;
}

/// What the free vertices have of the corners of a face.
class FaceShares {
 public:
  FaceShares(const TractionMesh& mesh, std::size_t face) {
    for (std::size_t k = 0; k < 4; ++k) {
      for (const auto& [vertex, share] : shares_of(mesh, mesh.quads.faces[face][k])) {
        auto found = std::ranges::find(shares_, vertex, &VertexShare::vertex);
        if (found == shares_.end()) found = shares_.insert(found, {vertex, 0});
        parts_.push_back({k, static_cast<std::size_t>(found - shares_.begin()), share});
      }
    }
  }
  /// @param x, y  of the face's sides, 0 to 1
  std::span<const VertexShare> at(double x, double y) {
    const std::array<double, 4> of_corners = {(1 - x) * (1 - y), x * (1 - y), x * y, (1 - x) * y};
    for (VertexShare& s : shares_) s.share = 0;
    for (const Part& p : parts_) shares_[p.entry].share += p.share * of_corners[p.corner];
    return shares_;
  }

 private:
  struct Part {
    std::size_t corner, entry;
    double share;
  };
  std::vector<VertexShare> shares_;
  std::vector<Part> parts_;
};

}  // namespace

Vec2 TractionMesh::low_corner_um(const Leaf& leaf) const {
  const Vec2 size = size_um(leaf);
  return low_um + Vec2{leaf.column * size.x, leaf.row * size.y};
}

int TractionMesh::finest_level() const { return std::ranges::max_element(leaves, {}, &Leaf::level)->level; }

TractionMesh make_traction_mesh(const Ground& ground, const Rectangle& over, double spacing_um,
                                const std::function<bool(Vec2)>& carries) {
  const Vec2 size = over.high_um - over.low_um;
  MBTFM_ASSERT(size.x > 0 && size.y > 0 && spacing_um > 0);
  const int n_x = std::max(1, static_cast<int>(std::ceil(size.x / spacing_um - 1e-9)));
  const int n_y = std::max(1, static_cast<int>(std::ceil(size.y / spacing_um - 1e-9)));
  const Vec2 spacing = {size.x / n_x, size.y / n_y};
  std::vector<Leaf> leaves;
  for (int row = 0; row < n_y; ++row) {
    for (int column = 0; column < n_x; ++column) {
      const Vec2 low = over.low_um + Vec2{column * spacing.x, row * spacing.y};
      if (carries(low + 0.5 * spacing)) leaves.push_back({0, column, row});
    }
  }
  if (leaves.empty()) {
    throw InvalidData("the region of tractions", "a part of the field of the beads",
                      "none of the lattice's faces of " + brief(spacing.x) + " um lies in it");
  }
  return mesh_of(std::move(leaves), over.low_um, spacing, ground);
}

TractionMesh with_split(const TractionMesh& mesh, const Ground& ground, const std::vector<bool>& is_split) {
  MBTFM_ASSERT(is_split.size() == mesh.leaves.size());
  Quadtree tree(mesh.leaves);
  for (std::size_t f = 0; f < is_split.size(); ++f) {
    if (is_split[f]) tree.split(mesh.leaves[f]);
  }
  return mesh_of(tree.in_order(mesh.leaves), mesh.low_um, mesh.spacing_um, ground);
}

TractionMesh evened(TractionMesh mesh, const Ground& ground) {
  const int finest = mesh.finest_level();
  for (int level = 0; level < finest; ++level) {
    std::vector<bool> is_split;
    for (const Leaf& leaf : mesh.leaves) is_split.push_back(leaf.level == level);
    mesh = with_split(mesh, ground, is_split);
  }
  return mesh;
}

std::vector<VertexShare> shares_of(const TractionMesh& mesh, int vertex) {
  std::vector<VertexShare> shares;
  for (Eigen::SparseMatrix<double, Eigen::RowMajor>::InnerIterator it(mesh.constraint, vertex); it; ++it)
    shares.push_back({static_cast<int>(it.col()), it.value()});
  return shares;
}

std::vector<VertexShare> shares_at(const TractionMesh& mesh, Vec2 at_um) {
  constexpr double kRim = 1e-9;  // of a face
  for (std::size_t f = 0; f < mesh.leaves.size(); ++f) {
    const Vec2 size = mesh.size_um(mesh.leaves[f]), off = at_um - mesh.low_corner_um(mesh.leaves[f]);
    const double x = off.x / size.x, y = off.y / size.y;
    if (x < -kRim || x > 1 + kRim || y < -kRim || y > 1 + kRim) continue;
    FaceShares of_face(mesh, f);
    const std::span<const VertexShare> shares = of_face.at(x, y);
    return {shares.begin(), shares.end()};
  }
  return {};
}

void over_faces(const TractionMesh& mesh, const Ground& ground, int n, Places places,
                const std::function<void(Vec2 at_um, std::span<const VertexShare> shares, double area_um2)>& use) {
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
  for (std::size_t f = 0; f < mesh.leaves.size(); ++f) {
    const Vec2 low = mesh.low_corner_um(mesh.leaves[f]), size = mesh.size_um(mesh.leaves[f]);
    FaceShares shares(mesh, f);
    for (int j = 0; j < n; ++j) {
      for (int i = 0; i < n; ++i) {
        const Vec2 place = low + Vec2{at[i] * size.x, at[j] * size.y};
        use(place, shares.at(at[i], at[j]), weight[i] * weight[j] * (size.x * size.y) * ground.stretch(place));
      }
    }
  }
}

MatrixXd Basis::response(const MatrixXd& by_traction, int threads) const {
  const Index n = shapes_.rows();
  MatrixXd response(by_traction.rows(), 3 * size()), columns(by_traction.rows(), n);
  for (Index c = 0; c < 3; ++c) {
    for (Index v = 0; v < n; ++v) columns.col(v) = by_traction.col(3 * v + c);
    response.middleCols(c * size(), size()) = numerics::product(columns, shapes_, threads);
  }
  return response;
}

VectorXd Basis::tractions(const VectorXd& x) const {
  const Index n = shapes_.rows();
  VectorXd t(3 * n);
  for (Index c = 0; c < 3; ++c) {
    const VectorXd of_component = numerics::matvec(shapes_, x.segment(c * size(), size()));
    for (Index v = 0; v < n; ++v) t[3 * v + c] = of_component[v];
  }
  return t;
}

VectorXd Basis::transposed(const VectorXd& by_vertex) const {
  const Index n = shapes_.rows();
  VectorXd x(3 * size()), of_component(n);
  for (Index c = 0; c < 3; ++c) {
    for (Index v = 0; v < n; ++v) of_component[v] = by_vertex[3 * v + c];
    x.segment(c * size(), size()) = numerics::transposed_matvec(shapes_, of_component);
  }
  return x;
}

MatrixXd Basis::covariance(const MatrixXd& of_x, int threads) const {
  const Index n = shapes_.rows(), m = size();
  MatrixXd by_vertex(3 * n, 3 * n);
  const MatrixXd transposed = shapes_.transpose();
  for (Index c = 0; c < 3; ++c) {
    for (Index d = 0; d <= c; ++d) {
      const MatrixXd half = numerics::product(of_x.block(c * m, d * m, m, m), transposed, threads);
      const MatrixXd block = numerics::product(shapes_, half, threads);
      for (Index v = 0; v < n; ++v) {
        for (Index w = 0; w < n; ++w) {
          by_vertex(3 * v + c, 3 * w + d) = block(v, w);
          by_vertex(3 * w + d, 3 * v + c) = block(v, w);
        }
      }
    }
  }
  return by_vertex;
}

MatrixXd norm_of(const TractionMesh& mesh, const Ground& ground, const std::function<double(Vec2)>& amplitude) {
  constexpr int kParts = 6;  // of a side: the amplitude jumps at a rim
  MatrixXd norm = MatrixXd::Zero(mesh.n_vertices(), mesh.n_vertices());
  over_faces(mesh, ground, kParts, Places::even, [&](Vec2 at, std::span<const VertexShare> shares, double area_um2) {
    const double a = amplitude(at);
    for (const auto& [v, of_v] : shares) {
      for (const auto& [w, of_w] : shares) norm(v, w) += of_v * of_w * area_um2 / (a * a);
    }
  });
  return norm;
}

Basis orthonormal_basis(MatrixXd norm_um2) {
  MBTFM_ASSERT(numerics::upper_cholesky(norm_um2));
  MatrixXd shapes = MatrixXd::Identity(norm_um2.rows(), norm_um2.cols());
  numerics::solve_upper(norm_um2, shapes);
  return Basis(std::move(shapes));
}

Basis spot_basis(const TractionMesh& mesh, const Ground& ground, double width_um) {
  const Index n = mesh.n_vertices();
  const auto place = [&](Index v) {
    const Vec2 at = mesh.quads.points_um[v];
    return Vec3{at.x, at.y, ground.height_um(at)};
  };
  const Eigen::Map<const VectorXd> areas(mesh.areas_um2.data(), n);
  MatrixXd shapes(n, n);
  for (Index i = 0; i < n; ++i) {
    for (Index j = 0; j < n; ++j) {
      const double away = norm(place(i) - place(j)) / width_um;
      shapes(i, j) = std::exp(-0.5 * away * away) * areas[j];
    }
    shapes.row(i) /= shapes.row(i).sum();
  }
  return Basis(shapes * areas.cwiseSqrt().cwiseInverse().asDiagonal());
}

double spot_width_um(double bead_distance_um) {
  // as wide, at half their height, as 1.3 distances: measured, with 0.9 and 1.7 of them maps are 7 to 20 % worse
  // (notes/tractions_in_space.md)
  constexpr double kDistances = 0.55;
  return kDistances * bead_distance_um;
}

}  // namespace mbtfm::spatial
