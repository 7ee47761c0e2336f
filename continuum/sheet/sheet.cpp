#include "continuum/sheet/sheet.h"

namespace mbtfm::sheet {

Tensor elastic_tension(const Material& material, const Tensor& strain) {
  const double M = material.stiffness_nN_per_um(), nu = material.poisson_ratio;
  const double even_part = nu * (strain.xx + strain.yy);
  return {M * ((1 - nu) * strain.xx + even_part), M * ((1 - nu) * strain.yy + even_part), M * (1 - nu) * strain.xy};
}

std::vector<double> even(const Elements& elements, double value) {
  return std::vector<double>(static_cast<std::size_t>(Elements::kPoints * elements.n_triangles()), value);
}

Vec2 value_of(const NodeVectors& u, const std::array<int, 6>& nodes, const Shape& shape) {
  Vec2 value;
  for (int i = 0; i < 6; ++i) value += shape.value[i] * at_node(u, nodes[i]);
  return value;
}

Eigen::Matrix2d gradient_of(const NodeVectors& u, const std::array<int, 6>& nodes, const Shape& shape) {
  Eigen::Matrix2d gradient = Eigen::Matrix2d::Zero();
  for (int i = 0; i < 6; ++i) {
    const Vec2 g = shape.gradient_per_um[i];
    gradient += u.segment<2>(2 * nodes[i]) * Eigen::RowVector2d(g.x, g.y);
  }
  return gradient;
}

Tensor strain_of(const NodeVectors& u, const std::array<int, 6>& nodes, const Shape& shape) {
  const Eigen::Matrix2d g = gradient_of(u, nodes, shape);
  return {g(0, 0), g(1, 1), 0.5 * (g(0, 1) + g(1, 0))};
}

NodeVectors forces_of_contraction_nN(const Elements& elements, const Sheet& sheet) {
  NodeVectors f = NodeVectors::Zero(2 * elements.n_nodes());
  elements.for_each_point([&](int t, int p, const Shape& shape) {
    const double pull = shape.weight_um2 * sheet.contraction_nN_per_um[Elements::kPoints * t + p];
    for (int i = 0; i < 6; ++i) {
      f(2 * elements.nodes(t)[i]) -= pull * shape.gradient_per_um[i].x;
      f(2 * elements.nodes(t)[i] + 1) -= pull * shape.gradient_per_um[i].y;
    }
  });
  if (sheet.line_tension_nN == 0) return f;
  // −Λ ∫ t · dv/ds ds, three Gauss points on each side
  constexpr std::array<double, 3> kAt = {-0.7745966692414834, 0, 0.7745966692414834};
  constexpr std::array<double, 3> kWeight = {5.0 / 9, 8.0 / 9, 5.0 / 9};
  for (const Triangles::Side& side : elements.triangles().sides) {
    if (side.curve >= sheet.n_rims) continue;
    for (int q = 0; q < 3; ++q) {
      const double x = kAt[q];
      const std::array<double, 3> slope = {x - 0.5, x + 0.5, -2 * x};  // of begin, end, between
      Vec2 along;
      for (int i = 0; i < 3; ++i) along += slope[i] * elements.triangles().nodes_um[side.nodes[i]];
      const Vec2 pull = sheet.line_tension_nN * kWeight[q] / norm(along) * along;
      for (int i = 0; i < 3; ++i) {
        f(2 * side.nodes[i]) -= slope[i] * pull.x;
        f(2 * side.nodes[i] + 1) -= slope[i] * pull.y;
      }
    }
  }
  return f;
}

std::vector<Tensor> tension_at_points(const Elements& elements, const Sheet& sheet, const NodeVectors& u) {
  std::vector<Tensor> tension(sheet.contraction_nN_per_um.size());
  elements.for_each_point([&](int t, int p, const Shape& shape) {
    const auto k = static_cast<std::size_t>(Elements::kPoints * t + p);
    const double s = sheet.contraction_nN_per_um[k];
    tension[k] = elastic_tension(sheet.material, strain_of(u, elements.nodes(t), shape)) + Tensor{s, s, 0};
  });
  return tension;
}

}  // namespace mbtfm::sheet
