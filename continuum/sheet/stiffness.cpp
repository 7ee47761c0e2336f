#include "continuum/sheet/stiffness.h"

#include <cmath>

namespace mbtfm::sheet {
namespace {

std::vector<int> nodes_of(const Elements& elements) {
  std::vector<int> nodes;
  for (const auto& of_triangle : elements.triangles().nodes)
    nodes.insert(nodes.end(), of_triangle.begin(), of_triangle.end());
  return nodes;
}

}  // namespace

Stiffness::Stiffness(const Elements& elements, std::vector<std::array<bool, 2>> held)
    : HeldMatrix(elements.n_nodes(), nodes_of(elements), 6, std::move(held)) {
  set_zero();
}

Stiffness::OfElement elastic_stiffness(const Elements& elements, int triangle, const Material& material) {
  const double M = material.stiffness_nN_per_um(), nu = material.poisson_ratio;
  Stiffness::OfElement K = Stiffness::OfElement::Zero();
  for (int p = 0; p < Elements::kPoints; ++p) {
    const Shape& shape = elements.at(triangle, p);
    const double shear = 0.5 * (1 - nu) * M * shape.weight_um2, direct = M * shape.weight_um2;
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) {
        const Vec2 a = shape.gradient_per_um[i], b = shape.gradient_per_um[j];
        K(2 * i, 2 * j) += direct * a.x * b.x + shear * a.y * b.y;
        K(2 * i, 2 * j + 1) += nu * direct * a.x * b.y + shear * a.y * b.x;
        K(2 * i + 1, 2 * j) += nu * direct * a.y * b.x + shear * a.x * b.y;
        K(2 * i + 1, 2 * j + 1) += direct * a.y * b.y + shear * a.x * b.x;
      }
  }
  return K;
}

Stiffness::OfElement spring_stiffness(const Elements& elements, int triangle, const double* by_point) {
  Stiffness::OfElement K = Stiffness::OfElement::Zero();
  for (int p = 0; p < Elements::kPoints; ++p) {
    const Shape& shape = elements.at(triangle, p);
    for (int i = 0; i < 6; ++i)
      for (int j = 0; j < 6; ++j) {
        const double k = by_point[p] * shape.weight_um2 * shape.value[i] * shape.value[j];
        K(2 * i, 2 * j) += k;
        K(2 * i + 1, 2 * j + 1) += k;
      }
  }
  return K;
}

std::vector<std::array<bool, 2>> pins(const Elements& elements) {
  std::vector<std::array<bool, 2>> held(static_cast<std::size_t>(elements.n_nodes()), {false, false});
  const std::vector<Vec2>& nodes = elements.triangles().nodes_um;
  std::size_t furthest = 0;
  for (std::size_t i = 0; i < nodes.size(); ++i)
    if (norm(nodes[i] - nodes[0]) > norm(nodes[furthest] - nodes[0])) furthest = i;
  const Vec2 along = nodes[furthest] - nodes[0];
  held[0] = {true, true};
  held[furthest][std::abs(along.x) > std::abs(along.y) ? 1 : 0] = true;
  return held;
}

}  // namespace mbtfm::sheet
