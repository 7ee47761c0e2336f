#include "continuum/sheet/moved_rims.h"

#include <algorithm>
#include <map>

#include "continuum/sheet/stiffness.h"
#include "pipeline/contract/errors.h"

namespace mbtfm::sheet {
namespace {

/// Away from the sheet, of unit length, at the begin, the end and the middle of a side.
std::array<Vec2, 3> normals_of(const Elements& elements, const Triangles::Side& side) {
  const auto node = [&](int k) { return elements.triangles().nodes_um[side.nodes[k]]; };
  const Vec2 begin = node(0), end = node(1), between = node(2);
  // derivatives of the parabola through the three
  const std::array<Vec2, 3> along = {-1.5 * begin - 0.5 * end + 2 * between, 0.5 * begin + 1.5 * end - 2 * between,
                                     0.5 * (end - begin)};
  std::array<Vec2, 3> normals;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vec2 right{along[k].y,
                     -along[k].x};  // curves turn from +x towards +y: the outer one has the sheet on its left
    normals[k] = (side.curve == 0 ? 1.0 : -1.0) / norm(right) * right;
  }
  return normals;
}

/// By node of the rims. At a corner both sides move by this much, so it moves by more.
std::map<int, Vec2> moves_of_rims(const Elements& elements, int n_rims, double outward_um) {
  std::map<int, std::vector<Vec2>> normals;
  for (const Triangles::Side& side : elements.triangles().sides) {
    if (side.curve >= n_rims) continue;
    const std::array<Vec2, 3> of_side = normals_of(elements, side);
    for (std::size_t k = 0; k < 3; ++k) normals[side.nodes[k]].push_back(of_side[k]);
  }
  constexpr double kSharpest = 0.5;  // a spike's tip moves no further than four times as much
  std::map<int, Vec2> moves;
  for (const auto& [node, at] : normals) {
    const Vec2 first = at.front(), last = at.back();
    moves[node] = outward_um / std::max(kSharpest, 1 + dot(first, last)) * (first + last);
  }
  return moves;
}

}  // namespace

Elements with_rims_further_out(const Elements& elements, int n_rims, double outward_um) {
  const std::map<int, Vec2> moves = moves_of_rims(elements, n_rims, outward_um);
  std::vector<std::array<bool, 2>> held(static_cast<std::size_t>(elements.n_nodes()), {false, false});
  NodeVectors move = NodeVectors::Zero(2 * elements.n_nodes());
  for (const auto& [node, by_um] : moves) {
    held[node] = {true, true};
    move.segment<2>(2 * node) << by_um.x, by_um.y;
  }
  Stiffness stiffness(elements, std::move(held));
  NodeVectors pulled = NodeVectors::Zero(move.size());
  for (int t = 0; t < elements.n_triangles(); ++t) {
    const Stiffness::OfElement K =
        elastic_stiffness(elements, t, {.youngs_modulus_kPa = 1, .poisson_ratio = 0, .thickness_um = 1});
    stiffness.add(t, K);
    Eigen::Matrix<double, 12, 1> of_nodes;
    for (int i = 0; i < 6; ++i) of_nodes.segment<2>(2 * i) = move.segment<2>(2 * elements.nodes(t)[i]);
    const Eigen::Matrix<double, 12, 1> forces = K * of_nodes;
    for (int i = 0; i < 6; ++i) pulled.segment<2>(2 * elements.nodes(t)[i]) -= forces.segment<2>(2 * i);
  }
  const bool is_definite = stiffness.factorise();
  MBTFM_ASSERT(is_definite);
  move += stiffness.solve(pulled);
  Triangles moved = elements.triangles();
  for (int i = 0; i < elements.n_nodes(); ++i) moved.nodes_um[i] += at_node(move, i);
  return Elements(std::move(moved));
}

}  // namespace mbtfm::sheet
