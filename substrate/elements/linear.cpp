#include "substrate/elements/linear.h"

#include <cmath>
#include <map>

#include "substrate/material.h"

namespace mbtfm::elements {
namespace {

NodePositions nodes_of_box(const Box& box) {
  NodePositions nodes;
  for (int k = 0; k < kNodes; ++k) {
    for (int axis = 0; axis < 3; ++axis) nodes(axis, k) = box.low_um[axis] + unit_of_node(k)[axis] * box.size_um[axis];
  }
  return nodes;
}

}  // namespace

std::function<MatrixXd(int cell)> linear_stiffness_of(const substrate::Material& material, const Mesh& mesh) {
  return [=, &mesh](int cell) { return linear_stiffness(Element(mesh.positions_of(cell)), material); };
}

std::function<MatrixXd(int cell)> box_stiffness_of(const substrate::Material& material, const BlockMesh& mesh) {
  constexpr double kDigits = 1e9;  // sides equal to rounding are equal
  struct OfBox {
    const MatrixXd* unit;
    double factor;
  };
  // if the modulus changes within them, they also differ by length and depth
  std::map<std::array<long, 4>, MatrixXd> by_shape;
  std::vector<OfBox> of_boxes;
  for (const Box& box : mesh.cells) {
    const auto& [low, size] = box;
    const auto even = substrate::even_modulus(material, low[2], low[2] + size[2]);
    const auto digits = [](double length) { return std::lround(kDigits * length); };
    const auto [known, is_new] = by_shape.try_emplace(
        {digits(size[1] / size[0]), digits(size[2] / size[0]), even ? 0 : digits(low[2]), even ? 0 : digits(size[0])});
    if (is_new) {
      const Box unit = {{}, {1, size[1] / size[0], size[2] / size[0]}};
      known->second = linear_stiffness(Element(nodes_of_box(even ? unit : box)),
                                       even ? substrate::Material{material.gel, {}} : material);
    }
    of_boxes.push_back({&known->second, even ? *even * size[0] : 1});
  }
  return [shapes = std::make_shared<const decltype(by_shape)>(std::move(by_shape)),
          boxes = std::move(of_boxes)](int cell) -> MatrixXd { return boxes[cell].factor * *boxes[cell].unit; };
}

std::vector<double> layers_um(double depth_um, int n) {
  constexpr double kGrowth = 1.4;
  std::vector<double> lines;
  for (int k = 0; k <= n; ++k) lines.push_back(depth_um * (std::pow(kGrowth, k) - 1) / (std::pow(kGrowth, n) - 1));
  lines.back() = depth_um;
  return lines;
}

}  // namespace mbtfm::elements
