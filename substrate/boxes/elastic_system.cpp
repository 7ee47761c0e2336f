#include "substrate/boxes/elastic_system.h"

#include <cmath>
#include <map>
#include <string>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/memory.h"
#include "substrate/boxes/ellipse_load.h"
#include "substrate/ellipse.h"

namespace mbtfm::boxes {

namespace {

/// Stiffness by shape of box: similar boxes of one modulus have the same but for length and modulus. Where the modulus
/// changes within them, by shape, length and depth.
class StiffnessOfBox {
 public:
  StiffnessOfBox(const substrate::Material& material, int order) : material_(material), order_(order) {}
  MatrixXd operator()(const Box& box) {
    constexpr double kDigits = 1e9;  // sides equal to rounding are equal
    const std::array<double, 3>& size = box.size_um;
    const auto even = substrate::even_modulus(material_, box.low_um[2], box.low_um[2] + size[2]);
    std::array<long, 4> key = {std::lround(kDigits * size[1] / size[0]), std::lround(kDigits * size[2] / size[0]), 0,
                               0};
    if (!even) key[2] = std::lround(kDigits * box.low_um[2]), key[3] = std::lround(kDigits * size[0]);
    auto found = known_.find(key);
    if (found == known_.end()) {
      const Box unit = {{}, {1, size[1] / size[0], size[2] / size[0]}};
      found = known_
                  .emplace(key, even ? box_stiffness({material_.gel, {}}, order_, unit)
                                     : box_stiffness(material_, order_, box))
                  .first;
    }
    return (even ? *even * size[0] : 1) * found->second;
  }

 private:
  substrate::Material material_;
  int order_;
  std::map<std::array<long, 4>, MatrixXd> known_;
};

std::string shown(Vec2 point) { return "(" + std::to_string(point.x) + ", " + std::to_string(point.y) + ")"; }

/// The bottom's coordinate is a grid line: reached to rounding.
std::vector<char> is_on_bottom(const BlockMesh& mesh) {
  std::vector<char> is_bottom;
  for (const auto& position : mesh.position_um) is_bottom.push_back(position[2] > mesh.thickness_um() * (1 - 1e-9));
  return is_bottom;
}

std::string extent_of(const GridLines& lines) {
  return shown({lines.x_um.front(), lines.y_um.front()}) + " to " + shown({lines.x_um.back(), lines.y_um.back()});
}

}  // namespace

double allowed_GB(double memory_limit_GB) {
  if (memory_limit_GB > 0) return memory_limit_GB;
  return 0.8e-9 * numerics::memory_bytes();
}

ElasticSystem::ElasticSystem(const substrate::Material& material, BlockMesh mesh,
                             const numerics::FactorOptions& options)
    : mesh_(std::move(mesh)),
      nodes_(mesh_.cell_nodes, mesh_.nodes_per_cell(), mesh_.hanging, is_on_bottom(mesh_)),
      factor_(assemble(material), options) {}

numerics::BlockMatrix<3> ElasticSystem::assemble(const substrate::Material& material) {
  numerics::BlockMatrix<3> matrix = nodes_.pattern();
  std::vector<Eigen::Triplet<double>> bottom;
  const auto add_bottom = [&](int row, int node, const Eigen::Matrix3d& block) {
    const int fixed = nodes_.held_index_of(node);
    for (int p = 0; p < 3; ++p) {
      for (int q = 0; q < 3; ++q) bottom.emplace_back(3 * row + p, 3 * fixed + q, block(p, q));
    }
  };
  StiffnessOfBox stiffness_of(material, mesh_.order);
  for (int cell = 0; cell < nodes_.n_cells(); ++cell) {
    nodes_.add(cell, stiffness_of(mesh_.cells[cell]), matrix, add_bottom);
  }
  bottom_stiffness_.resize(n_unknowns(), 3 * static_cast<Index>(nodes_.held().size()));
  bottom_stiffness_.setFromTriplets(bottom.begin(), bottom.end());
  return matrix;
}

std::vector<std::array<double, 3>> ElasticSystem::at_all_nodes(const numerics::NodalColumn& u) const {
  std::vector<std::array<double, 3>> values(mesh_.position_um.size());
  for (std::size_t node = 0; node < values.size(); ++node) {
    for (const NodeWeight& carrier : nodes_.carriers(static_cast<int>(node))) {
      const int from = nodes_.index_of(carrier.node);
      for (int axis = 0; from >= 0 && axis < 3; ++axis) values[node][axis] += carrier.weight * u(from, axis);
    }
  }
  return values;
}

std::vector<NodeWeight> ElasticSystem::cell_weights(int cell, std::array<double, 3> unit) const {
  const int n = mesh_.order + 1;
  std::array<std::array<double, 3>, 3> value;
  for (int axis = 0; axis < 3; ++axis) value[axis] = shape_values(mesh_.order, unit[axis]);
  std::vector<NodeWeight> weights;
  for (int k = 0; k < mesh_.nodes_per_cell(); ++k) {
    const double shape = value[0][k % n] * value[1][k / n % n] * value[2][k / (n * n)];
    if (shape == 0) continue;
    weights.push_back({mesh_.nodes_of(cell)[k], shape});
  }
  return nodes_.on_free_nodes(weights);
}

std::vector<NodeWeight> ElasticSystem::surface_weights(Vec2 point_um) const {
  const int cell = surface_cell(mesh_, point_um);
  if (cell < 0) {
    throw InvalidData("point " + shown(point_um), "one in the gel's block, " + extent_of(mesh_.lines), "it outside");
  }
  const Box& box = mesh_.cells[cell];
  return cell_weights(
      cell, {(point_um.x - box.low_um[0]) / box.size_um[0], (point_um.y - box.low_um[1]) / box.size_um[1], 0});
}

std::vector<int> ElasticSystem::touched_cells(const substrate::Ellipse& ellipse) const {
  std::vector<int> touched;
  const Vec2 extent = substrate::half_extent_um(ellipse);
  for (std::size_t cell = 0; cell < mesh_.cells.size(); ++cell) {
    const Box& box = mesh_.cells[cell];
    if (box.low_um[2] > 0) continue;
    const Vec2 low = {box.low_um[0], box.low_um[1]};
    const Vec2 high = {low.x + box.size_um[0], low.y + box.size_um[1]};
    const Vec2 c = ellipse.centre_um;
    if (low.x > c.x + extent.x || high.x < c.x - extent.x || low.y > c.y + extent.y || high.y < c.y - extent.y)
      continue;
    if (!clipped_ellipse_rule(ellipse, {low, high}).empty()) touched.push_back(static_cast<int>(cell));
  }
  return touched;
}

std::vector<NodeWeight> ElasticSystem::load_weights(const substrate::Ellipse& ellipse) const {
  std::vector<NodeWeight> load;
  double share = 0;
  for (const int cell : touched_cells(ellipse)) {
    const Box& box = mesh_.cells[cell];
    const Vec2 low = {box.low_um[0], box.low_um[1]};
    const Vec2 high = {low.x + box.size_um[0], low.y + box.size_um[1]};
    for (const substrate::DiscPoint& p : clipped_ellipse_rule(ellipse, {low, high})) {
      share += p.weight;
      const Vec2 unit = p.position - low;
      for (const NodeWeight& w : cell_weights(cell, {unit.x / box.size_um[0], unit.y / box.size_um[1], 0})) {
        load.push_back({w.node, p.weight * w.weight});
      }
    }
  }
  // the rules add up to rounding: what is missing lies outside
  if (std::abs(share - 1) > 1e-9) {
    throw InvalidData("the ellipse at " + shown(ellipse.centre_um),
                      "all of it on the gel's block, " + extent_of(mesh_.lines),
                      std::to_string(100 * (1 - share)) + " % of it outside");
  }
  merge(load);
  return load;
}

}  // namespace mbtfm::boxes
