#include "continuum/solids/mesh.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::solids {
namespace {

/// Joins nodes that lie nearer to each other than rounding can resolve.
class NodesByPlace {
 public:
  NodesByPlace(double same_um, std::vector<Vec2>& positions) : same_um_(same_um), positions_(&positions) {}

  int at(Vec2 place) {
    const auto i = std::llround(place.x / same_um_), j = std::llround(place.y / same_um_);
    for (long long di = -1; di <= 1; ++di) {
      for (long long dj = -1; dj <= 1; ++dj) {
        const auto found = node_at_.find({i + di, j + dj});
        if (found != node_at_.end()) return found->second;
      }
    }
    const int node = static_cast<int>(positions_->size());
    node_at_[{i, j}] = node;
    positions_->push_back(place);
    return node;
  }

 private:
  double same_um_;
  std::vector<Vec2>* positions_;
  std::map<std::pair<long long, long long>, int> node_at_;
};

double size_um(const std::vector<Patch>& patches) {
  double size = 0;
  for (const Patch& patch : patches) {
    for (const Vec2 corner : {Vec2{0, 0}, Vec2{1, 0}, Vec2{0, 1}, Vec2{1, 1}}) {
      const Vec2 at = patch.place_um(corner);
      size = std::max({size, std::abs(at.x), std::abs(at.y)});
    }
  }
  return size;
}

}  // namespace

std::function<Vec2(Vec2 unit)> between(Side low_v, Side high_v, Side low_u, Side high_u) {
  return [=](Vec2 at) {
    const double u = at.x, v = at.y;
    const Vec2 across = (1 - v) * low_v(u) + v * high_v(u) + (1 - u) * low_u(v) + u * high_u(v);
    const Vec2 corners = (1 - u) * ((1 - v) * low_v(0) + v * high_v(0)) + u * ((1 - v) * low_v(1) + v * high_v(1));
    return across - corners;
  };
}

Side straight(Vec2 from_um, Vec2 to_um) {
  return [=](double share) { return (1 - share) * from_um + share * to_um; };
}

std::vector<double> even_lines(int n) {
  std::vector<double> lines;
  for (int k = 0; k <= n; ++k) lines.push_back(static_cast<double>(k) / n);
  return lines;
}

std::vector<double> lines_towards_zero(int n) {
  constexpr double kCloser = 0.2;  // near the best for corners: Schwab (1998), §3.3
  std::vector<double> lines = {0};
  for (int k = n - 1; k >= 0; --k) lines.push_back(std::pow(kCloser, k));
  return lines;
}

std::vector<double> turned(const std::vector<double>& lines) {
  std::vector<double> other;
  for (auto line = lines.rbegin(); line != lines.rend(); ++line) other.push_back(1 - *line);
  return other;
}

Nodes Mesh::values_of(const std::vector<Vec2>& by_node, int element) const {
  Nodes values(2, square.n_nodes());
  for (int k = 0; k < square.n_nodes(); ++k) {
    const Vec2 at = by_node[nodes_of(element)[k]];
    values.col(k) << at.x, at.y;
  }
  return values;
}

Mesh::Place Mesh::place_in(int patch, Vec2 unit) const {
  const Cut& cut = patches[patch];
  const auto along = [](const std::vector<double>& lines, double at) {
    const auto above = std::upper_bound(lines.begin() + 1, lines.end() - 1, at);
    const double low = *(above - 1);
    return std::pair{static_cast<int>(above - 1 - lines.begin()), (at - low) / (*above - low)};
  };
  const auto [i, u] = along(cut.u_lines, unit.x);
  const auto [j, v] = along(cut.v_lines, unit.y);
  return {cut.first + j * (static_cast<int>(cut.u_lines.size()) - 1) + i, {u, v}};
}

Mesh make_mesh(const std::vector<Patch>& patches, int order) {
  constexpr double kSame = 1e-9;       // of the body: far below the distance of nodes, far above rounding
  constexpr double kLeastSine = 0.05;  // 3 degrees
  Mesh mesh{.square = Square(order)};
  NodesByPlace by_place(kSame * size_um(patches), mesh.position_um);
  const std::vector<double>& nodes = mesh.square.nodes();
  for (const Patch& patch : patches) {
    mesh.patches.push_back({mesh.n_elements(), patch.u_lines, patch.v_lines});
    for (std::size_t j = 1; j < patch.v_lines.size(); ++j) {
      for (std::size_t i = 1; i < patch.u_lines.size(); ++i) {
        const auto within = [&](const std::vector<double>& lines, std::size_t k, double share) {
          return (1 - share) * lines[k - 1] + share * lines[k];
        };
        for (const double v : nodes) {
          for (const double u : nodes)
            mesh.nodes.push_back(
                by_place.at(patch.place_um({within(patch.u_lines, i, u), within(patch.v_lines, j, v)})));
        }
        mesh.part.push_back(patch.part);
        const double sine = least_sine(mesh.square, mesh.positions_of(mesh.n_elements() - 1));
        if (!(sine > kLeastSine))
          throw InvalidData("the mesh", "elements whose lines meet at 3 degrees and more", "a sine of " + brief(sine));
      }
    }
  }
  return mesh;
}

}  // namespace mbtfm::solids
