#include "continuum/sheet/recovery.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <tuple>

#include "pipeline/numerics/dense.h"

namespace mbtfm::sheet {
namespace {

/// Of a cubic polynomial; of a quadratic one the first six.
constexpr int kCubic = 10, kQuadratic = 6;
template <int n>
using Terms = Eigen::Matrix<double, 1, n>;

template <int n>
Terms<n> terms_of(Vec2 d) {
  const double x = d.x, y = d.y;
  return (Terms<kCubic>() << 1, x, y, x * x, x * y, y * y, x * x * x, x * x * y, x * y * y, y * y * y)
      .finished()
      .leftCols<n>();
}
template <int n>
Terms<n> terms_by_x(Vec2 d) {
  const double x = d.x, y = d.y;
  return (Terms<kCubic>() << 0, 1, 0, 2 * x, y, 0, 3 * x * x, 2 * x * y, y * y, 0).finished().leftCols<n>();
}
template <int n>
Terms<n> terms_by_y(Vec2 d) {
  const double x = d.x, y = d.y;
  return (Terms<kCubic>() << 0, 0, 1, 0, x, 2 * y, 0, x * x, 2 * x * y, 3 * y * y).finished().leftCols<n>();
}

struct Patch {
  Vec2 centre_um;
  double size_um = 1;
  Eigen::Matrix<double, kCubic, 3> coefficients;
  Tensor at(Vec2 place) const {
    const Eigen::RowVector3d v = terms_of<kCubic>(1 / size_um * (place - centre_um)) * coefficients;
    return {v(0), v(1), v(2)};
  }
};

/// Least squares for the coefficients of the three components: xx, yy, xy in turn.
template <int n>
class PatchFit {
 public:
  PatchFit(Vec2 centre_um, double size_um) : patch_{centre_um, size_um, Eigen::Matrix<double, kCubic, 3>::Zero()} {
    normal_.setZero();
    right_.setZero();
  }

  void add_value(const Shape& shape, const Tensor& value) { add_value(shape.place_um, shape.weight_um2, value); }
  void add_value(Vec2 place_um, double weight_um2, const Tensor& value) {
    const Terms<n> t = terms_of<n>(local(place_um));
    const Eigen::Matrix<double, n, n> square = weight_um2 * t.transpose() * t;
    const std::array<double, 3> values = {value.xx, value.yy, value.xy};
    for (int c = 0; c < 3; ++c) {
      normal_.template block<n, n>(n * c, n * c) += square;
      right_.template segment<n>(n * c) += weight_um2 * values[c] * t.transpose();
    }
  }
  /// div S = traction: an error of it over the patch is one of S.
  void add_divergence(const Shape& shape, Vec2 traction_kPa) {
    const Vec2 d = local(shape.place_um);
    const Terms<n> by_x = terms_by_x<n>(d), by_y = terms_by_y<n>(d), none = Terms<n>::Zero();
    constexpr double kWeight = 10;  // T follows from u, which is an order closer than S
    add_row(kWeight * shape.weight_um2, by_x, none, by_y, patch_.size_um * traction_kPa.x);
    add_row(kWeight * shape.weight_um2, none, by_y, by_x, patch_.size_um * traction_kPa.y);
  }
  /// S n = pull at a place of the edge.
  void add_edge(Vec2 place_um, Vec2 normal, Vec2 pull_nN_per_um, double weight_um2) {
    const Terms<n> t = terms_of<n>(local(place_um)), none = Terms<n>::Zero();
    add_row(weight_um2, normal.x * t, none, normal.y * t, pull_nN_per_um.x);
    add_row(weight_um2, none, normal.y * t, normal.x * t, pull_nN_per_um.y);
  }
  Patch solved() {
    const Eigen::Matrix<double, 3 * n, 1> found = numerics::solve_symmetric(normal_, right_);
    for (int c = 0; c < 3; ++c) patch_.coefficients.col(c).template head<n>() = found.template segment<n>(n * c);
    return patch_;
  }

 private:
  Vec2 local(Vec2 place) const { return 1 / patch_.size_um * (place - patch_.centre_um); }
  void add_row(double weight, const Terms<n>& xx, const Terms<n>& yy, const Terms<n>& xy, double value) {
    const Eigen::Matrix<double, 1, 3 * n> row = (Eigen::Matrix<double, 1, 3 * n>() << xx, yy, xy).finished();
    normal_ += weight * row.transpose() * row;
    right_ += weight * value * row.transpose();
  }
  Patch patch_;
  Eigen::Matrix<double, 3 * n, 3 * n> normal_;
  Eigen::Matrix<double, 3 * n, 1> right_;
};

/// Triangles around each corner; where they are few, as at the rim, with their neighbours.
std::vector<std::vector<int>> triangles_around(const Elements& elements) {
  constexpr std::size_t kFewest = 4;
  std::vector<std::vector<int>> around(static_cast<std::size_t>(elements.triangles().n_corners));
  for (int t = 0; t < elements.n_triangles(); ++t)
    for (int i = 0; i < 3; ++i) around[elements.nodes(t)[i]].push_back(t);
  std::vector<std::vector<int>> patches = around;
  for (std::vector<int>& triangles : patches) {
    if (triangles.size() >= kFewest) continue;
    std::vector<int> more = triangles;
    for (const int t : triangles)
      for (int i = 0; i < 3; ++i) {
        const auto& next = around[elements.nodes(t)[i]];
        more.insert(more.end(), next.begin(), next.end());
      }
    std::sort(more.begin(), more.end());
    more.erase(std::unique(more.begin(), more.end()), more.end());
    triangles = more;
  }
  return patches;
}

/// A free side's three nodes: outward normal, the line's pull, and what the place counts beside the triangles' points.
struct EdgePlace {
  int node;
  Vec2 place_um, normal, pull_nN_per_um;
  double weight_um2;
};

/// By the circle through the three nodes: on it normals and curvature are exact.
std::vector<EdgePlace> places_of(const Triangles& triangles, const Triangles::Side& side, double line_tension_nN) {
  std::array<Vec2, 3> x;
  for (std::size_t i = 0; i < 3; ++i) x[i] = triangles.nodes_um[side.nodes[i]];
  const Vec2 chord = x[1] - x[0];
  const double length = norm(chord);
  // positive where the curve turns from +x towards +y, as the outer rim does, and rims of holes do, too
  const double curvature = 2 * cross(x[2] - x[0], chord) / (norm(x[2] - x[0]) * norm(x[1] - x[2]) * length);
  const double half_turn = std::asin(std::clamp(0.5 * length * curvature, -1.0, 1.0));
  const double outward = side.curve == 0 ? 1 : -1;
  constexpr double kWeight = 5;  // times the square on the side: the edge is known far better than the elements' S
  std::vector<EdgePlace> places;
  for (const auto& [i, angle, share] :
       {std::tuple{std::size_t{0}, -half_turn, 0.25}, {1, half_turn, 0.25}, {2, 0.0, 0.5}}) {
    const Vec2 t = 1 / length *
                   Vec2{std::cos(angle) * chord.x - std::sin(angle) * chord.y,
                        std::sin(angle) * chord.x + std::cos(angle) * chord.y};
    const Vec2 n = outward * Vec2{t.y, -t.x};
    places.push_back(
        {side.nodes[i], x[i], n, -outward * line_tension_nN * curvature * n, kWeight * share * length * length});
  }
  return places;
}

/// What the patches share.
struct Around {
  const Elements& elements;
  const std::vector<Tensor>& at_points;
  const KnownOfTension* known;                       ///< null: nothing
  std::vector<std::vector<int>> triangles;           ///< by corner
  std::vector<std::vector<std::size_t>> free_sides;  ///< by node between
  std::vector<char> is_on_line;                      ///< by node: T may jump there
};

template <int n>
Patch fitted(const Around& around, std::size_t corner) {
  const Elements& elements = around.elements;
  const Vec2 centre = elements.triangles().nodes_um[corner];
  double size = 0;
  for (const int t : around.triangles[corner])
    for (int p = 0; p < Elements::kPoints; ++p) size = std::max(size, norm(elements.at(t, p).place_um - centre));
  PatchFit<n> fit(centre, size);
  const bool has_balance = around.known != nullptr && !around.is_on_line[corner];
  for (const int t : around.triangles[corner]) {
    for (int p = 0; p < Elements::kPoints; ++p) {
      const auto k = static_cast<std::size_t>(Elements::kPoints * t + p);
      fit.add_value(elements.at(t, p), around.at_points[k]);
      if (has_balance) fit.add_divergence(elements.at(t, p), around.known->divergence_kPa[k]);
    }
    for (std::size_t i = 3; i < 6; ++i)
      for (const std::size_t side : around.free_sides[elements.nodes(t)[i]])
        for (const EdgePlace& place :
             places_of(elements.triangles(), elements.triangles().sides[side], around.known->line_tension_nN)) {
          const std::optional<Tensor>& value = around.known->at_nodes[place.node];
          if (value)
            fit.add_value(place.place_um, place.weight_um2, *value);
          else
            fit.add_edge(place.place_um, place.normal, place.pull_nN_per_um, place.weight_um2);
        }
  }
  return fit.solved();
}

std::vector<Tensor> recovered(const Elements& elements, const std::vector<Tensor>& at_points,
                              const KnownOfTension* known) {
  const Triangles& triangles = elements.triangles();
  const auto n_corners = static_cast<std::size_t>(triangles.n_corners),
             n_nodes = static_cast<std::size_t>(elements.n_nodes());
  Around around{elements,
                at_points,
                known,
                triangles_around(elements),
                std::vector<std::vector<std::size_t>>(n_nodes),
                std::vector<char>(n_nodes)};
  if (known != nullptr)
    for (std::size_t k = 0; k < triangles.sides.size(); ++k) {
      if (known->is_free[k]) around.free_sides[triangles.sides[k].nodes[2]].push_back(k);
      if (triangles.sides[k].curve >= known->n_rims)
        for (const int node : triangles.sides[k].nodes) around.is_on_line[node] = 1;
    }
  std::vector<Patch> patches;
  for (std::size_t corner = 0; corner < n_corners; ++corner) {
    // at the edge, where patches are one-sided, balance lets them be cubic
    const bool is_at_edge = std::ranges::any_of(around.triangles[corner], [&](int t) {
      for (std::size_t i = 3; i < 6; ++i)
        if (!around.free_sides[elements.nodes(t)[i]].empty()) return true;
      return false;
    });
    patches.push_back(is_at_edge ? fitted<kCubic>(around, corner) : fitted<kQuadratic>(around, corner));
  }
  std::vector<Tensor> at_nodes(static_cast<std::size_t>(elements.n_nodes()));
  for (std::size_t corner = 0; corner < n_corners; ++corner)
    at_nodes[corner] = patches[corner].at(triangles.nodes_um[corner]);
  for (int t = 0; t < elements.n_triangles(); ++t)
    for (int i = 0; i < 3; ++i) {
      const auto middle = static_cast<std::size_t>(elements.nodes(t)[3 + i]);
      const auto a = static_cast<std::size_t>(elements.nodes(t)[i]),
                 b = static_cast<std::size_t>(elements.nodes(t)[(i + 1) % 3]);
      const Vec2 place = triangles.nodes_um[middle];
      at_nodes[middle] = 0.5 * (patches[a].at(place) + patches[b].at(place));
    }
  if (known != nullptr)
    for (std::size_t node = 0; node < n_nodes; ++node) at_nodes[node] = known->at_nodes[node].value_or(at_nodes[node]);
  return at_nodes;
}

}  // namespace

std::vector<Tensor> recovered(const Elements& elements, const std::vector<Tensor>& at_points) {
  return recovered(elements, at_points, nullptr);
}

std::vector<Tensor> recovered(const Elements& elements, const std::vector<Tensor>& at_points,
                              const KnownOfTension& known) {
  return recovered(elements, at_points, &known);
}

namespace {

/// The nodes round each rim in their order, from corner to between to corner.
std::vector<std::vector<int>> rings_of(const Triangles& triangles, int n_rims) {
  std::map<int, const Triangles::Side*> from;  // by its first node: of rims, where each node begins one side
  for (const Triangles::Side& side : triangles.sides)
    if (side.curve < n_rims) from.emplace(side.nodes[0], &side);
  std::vector<std::vector<int>> rings;
  while (!from.empty()) {
    std::vector<int>& ring = rings.emplace_back();
    for (auto at = from.begin(); at != from.end();) {
      ring.push_back(at->second->nodes[0]);
      ring.push_back(at->second->nodes[2]);
      const int next = at->second->nodes[1];
      from.erase(at);
      at = from.find(next);
    }
  }
  return rings;
}

/// d/dp of the polynomial through five nodes, in the third of them.
std::array<double, 5> slope_weights(const std::array<double, 5>& p) {
  std::array<double, 5> weights{};
  for (std::size_t j = 0; j < 5; ++j) {
    double product = 1;
    for (std::size_t k = 0; k < 5; ++k)
      if (k != j) product *= p[j] - p[k];
    double sum = 0;
    for (std::size_t l = 0; l < 5; ++l) {
      if (l == j) continue;
      double others = 1;
      for (std::size_t k = 0; k < 5; ++k)
        if (k != j && k != l) others *= p[2] - p[k];
      sum += others;
    }
    weights[j] = sum / product;
  }
  return weights;
}

/// Strain along the rim at each of its nodes, of the polynomials through five of them in a row; none next to a corner.
std::vector<std::optional<double>> strain_along_rims(const Elements& elements, int n_rims, const NodeVectors& u) {
  constexpr double kCorner = 0.5;  // rad between two sides
  std::vector<std::optional<double>> strain(static_cast<std::size_t>(elements.n_nodes()));
  const std::vector<Vec2>& x = elements.triangles().nodes_um;
  for (const std::vector<int>& ring : rings_of(elements.triangles(), n_rims)) {
    const std::size_t n = ring.size();
    for (std::size_t i = 0; i < n && n >= 10; ++i) {
      std::array<int, 5> nodes;
      std::array<double, 5> p{};
      bool is_smooth = true;
      for (std::size_t k = 0; k < 5; ++k) {
        nodes[k] = ring[(i + n + k - 2) % n];
        if (k > 0) p[k] = p[k - 1] + norm(x[nodes[k]] - x[nodes[k - 1]]);
        if (k < 2) continue;
        const Vec2 a = x[nodes[k - 1]] - x[nodes[k - 2]];
        const Vec2 b = x[nodes[k]] - x[nodes[k - 1]];
        is_smooth = is_smooth && std::abs(std::atan2(cross(a, b), dot(a, b))) < kCorner;
      }
      if (!is_smooth) continue;
      const std::array<double, 5> weights = slope_weights(p);
      Vec2 along, change;
      for (std::size_t k = 0; k < 5; ++k) {
        along += weights[k] * x[nodes[k]];
        change += weights[k] * at_node(u, nodes[k]);
      }
      strain[nodes[2]] = dot(along, change) / dot(along, along);
    }
  }
  return strain;
}

/// S at the nodes of free rims: across by what pulls there, along by the strain.
std::vector<std::optional<Tensor>> tension_at_rims(const Elements& elements, const Sheet& sheet, const NodeVectors& u,
                                                   const std::vector<char>& is_free) {
  const std::vector<std::optional<double>> strain = strain_along_rims(elements, sheet.n_rims, u);
  std::vector<double> contraction(strain.size());
  for (int t = 0; t < elements.n_triangles(); ++t)
    for (const int node : elements.nodes(t)) contraction[node] = sheet.contraction_nN_per_um[Elements::kPoints * t];
  std::vector<std::optional<Tensor>> tension(strain.size());
  const double nu = sheet.material.poisson_ratio, youngs = sheet.material.youngs_tension_nN_per_um();
  const Triangles& triangles = elements.triangles();
  for (std::size_t k = 0; k < triangles.sides.size(); ++k) {
    if (!is_free[k]) continue;
    for (const EdgePlace& place : places_of(triangles, triangles.sides[k], sheet.line_tension_nN)) {
      const auto node = static_cast<std::size_t>(place.node);
      if (!strain[node]) continue;
      const double s = contraction[node], across = dot(place.pull_nN_per_um, place.normal);
      const double along = s + nu * (across - s) + youngs * *strain[node];
      const Vec2 n = place.normal;
      tension[node] = Tensor{across * n.x * n.x + along * n.y * n.y, across * n.y * n.y + along * n.x * n.x,
                             (across - along) * n.x * n.y};
    }
  }
  return tension;
}

}  // namespace

KnownOfTension known_on_springs(const Elements& elements, const Sheet& sheet, const NodeVectors& u) {
  KnownOfTension known{.divergence_kPa = {},
                       .line_tension_nN = sheet.line_tension_nN,
                       .n_rims = sheet.n_rims,
                       .is_free = {},
                       .at_nodes = {}};
  elements.for_each_point([&](int t, int p, const Shape& shape) {
    known.divergence_kPa.push_back(sheet.spring_nN_per_um3[Elements::kPoints * t + p] *
                                   value_of(u, elements.nodes(t), shape));
  });
  for (const Triangles::Side& side : elements.triangles().sides) {
    const auto middle = static_cast<std::size_t>(side.nodes[2]);
    const bool is_held = !sheet.held.empty() && (sheet.held[middle][0] || sheet.held[middle][1]);
    known.is_free.push_back(side.curve < sheet.n_rims && !is_held);
  }
  known.at_nodes = tension_at_rims(elements, sheet, u, known.is_free);
  return known;
}

Tensor value_of(const std::vector<Tensor>& at_nodes, const std::array<int, 6>& nodes, const Shape& shape) {
  Tensor value;
  for (int i = 0; i < 6; ++i) value = value + shape.value[i] * at_nodes[nodes[i]];
  return value;
}

double relative_error(const Elements& elements, const std::vector<Tensor>& at_points,
                      const std::vector<Tensor>& at_nodes) {
  const auto squared = [](const Tensor& a) { return a.xx * a.xx + a.yy * a.yy + 2 * a.xy * a.xy; };
  double error = 0, whole = 0;
  elements.for_each_point([&](int t, int p, const Shape& shape) {
    const Tensor smooth = value_of(at_nodes, elements.nodes(t), shape);
    const Tensor& own = at_points[Elements::kPoints * t + p];
    error += shape.weight_um2 * squared(smooth + (-1.0) * own);
    whole += shape.weight_um2 * squared(smooth);
  });
  return whole > 0 ? std::sqrt(error / whole) : 0;
}

Tensor mean_over(const Elements& elements, const std::vector<Tensor>& at_points) {
  Tensor sum;
  double area = 0;
  elements.for_each_point([&](int t, int p, const Shape& shape) {
    const double weight = shape.weight_um2;
    sum = sum + weight * at_points[Elements::kPoints * t + p];
    area += weight;
  });
  return 1 / area * sum;
}

}  // namespace mbtfm::sheet
