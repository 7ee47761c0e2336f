#include "substrate/elements/mesh.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::elements {
namespace {

std::string shown(const Eigen::Vector3d& p) {
  return "(" + brief(p.x()) + ", " + brief(p.y()) + ", " + brief(p.z()) + ") um";
}

}  // namespace

void check_inside(const Shape& shape, const Vec3& point_um) {
  const double surface = shape.height_um({point_um.x, point_um.y});
  const double rounding = 1e-9 * (shape.base_um - surface);
  if (point_um.z >= surface - rounding && point_um.z <= shape.base_um + rounding) return;
  throw InvalidData("point " + shown({point_um.x, point_um.y, point_um.z}),
                    "one between the gel's surface and its base",
                    "z = " + brief(point_um.z) + " um, with the surface there at " + brief(surface) +
                        " um and the base at " + brief(shape.base_um) + " um");
}

NodePositions Mesh::positions_of(int cell) const {
  NodePositions positions;
  for (int k = 0; k < kNodes; ++k) positions.col(k) = position_um[nodes_of(cell)[k]];
  return positions;
}

Block::Block(Shape shape, const GridLines& lines, const std::function<bool(const Box&)>& is_too_large, Sides sides,
             std::int64_t most_cells, int threads)
    : shape_(std::move(shape)), boxes_(make_block_mesh(lines, is_too_large, most_cells, threads)) {
  mesh_.cell_nodes = boxes_.cell_nodes;
  mesh_.hanging = boxes_.hanging;
  const double depth = lines.z_um.back();
  const auto is_end = [](const std::vector<double>& line, double x) { return x == line.front() || x == line.back(); };
  for (const auto& [x, y, z] : boxes_.position_um) {
    const double surface = shape_.height_um({x, y}), share = z / depth;
    mesh_.position_um.emplace_back(x, y, surface + share * (shape_.base_um - surface));
    const bool is_side = is_end(lines.x_um, x) || is_end(lines.y_um, y);
    mesh_.is_held.push_back(share > 1 - 1e-9 || (sides == Sides::held && is_side));  // the base: a line, to rounding
  }
  // a hanging node lies on the face of its larger neighbour, so that there is no gap
  for (std::size_t node = 0; node < mesh_.hanging.size(); ++node) {
    if (mesh_.hanging[node].empty()) continue;
    Eigen::Vector3d position = Eigen::Vector3d::Zero();
    for (const auto& [carrier, weight] : mesh_.hanging[node]) position += weight * mesh_.position_um[carrier];
    mesh_.position_um[node] = position;
  }
  for (int cell = 0; cell < mesh_.n_cells(); ++cell) {
    if (boxes_.cells[cell].low_um[2] == 0) mesh_.surface_cells.push_back(cell);
    const NodePositions nodes = mesh_.positions_of(cell);
    const double jacobian = least_scaled_jacobian(nodes);
    if (jacobian >= kLeastScaledJacobian) continue;
    throw InvalidData("the gel's surface at " + shown(nodes.rowwise().mean()),
                      "no wall so steep, and no surface so near the base, that an element between them is crushed (a "
                      "scaled Jacobian of 0.1 or more)",
                      brief(jacobian));
  }
}

Location Block::on_surface(Vec2 point_um) const {
  const int cell = cell_holding(boxes_, {point_um.x, point_um.y, 0});
  if (cell < 0) {
    throw InvalidData("point (" + brief(point_um.x) + ", " + brief(point_um.y) + ") um",
                      "one in the gel's block, " + boxes_.extent(), "it outside");
  }
  const Box& box = boxes_.cells[cell];
  return {cell, {(point_um.x - box.low_um[0]) / box.size_um[0], (point_um.y - box.low_um[1]) / box.size_um[1], 0}};
}

Location Block::locate(const Vec3& point_um) const {
  check_inside(shape_, point_um);
  const Eigen::Vector3d point(point_um.x, point_um.y, point_um.z);
  const double surface = shape_.height_um({point.x(), point.y()}), depth = boxes_.thickness_um();
  constexpr double kRounding = 1e-9;
  double z = std::clamp(depth * (point.z() - surface) / (shape_.base_um - surface), 0.0, depth);
  for (int step = 0; step < 8; ++step) {  // the pulled lines of hanging cells differ a little from the shape's own
    const int cell = cell_holding(boxes_, {point.x(), point.y(), z});
    if (cell < 0) throw InvalidData("point " + shown(point), "one in the gel's block", "it outside");
    const Box& box = boxes_.cells[cell];
    Eigen::Vector3d unit((point.x() - box.low_um[0]) / box.size_um[0], (point.y() - box.low_um[1]) / box.size_um[1],
                         (z - box.low_um[2]) / box.size_um[2]);
    const NodePositions nodes = mesh_.positions_of(cell);
    double slope = 0, error = 0;
    for (int newton = 0; newton < 8; ++newton) {
      error = point.z() - nodes.row(2).dot(shapes_at(unit));
      slope = nodes.row(2).dot(unit_slopes_at(unit).col(2));
      if (std::abs(error) < 1e-10 * depth) break;
      unit.z() += error / slope;
    }
    const bool is_above = unit.z() < 0 && box.low_um[2] == 0;
    const bool is_below = unit.z() > 1 && box.low_um[2] + box.size_um[2] > depth * (1 - 1e-9);
    // the mesh cuts corners of the surface: a point between the two is beyond its cell by so much
    if (is_above || is_below || (unit.z() >= -kRounding && unit.z() <= 1 + kRounding)) return {cell, unit};
    z = box.low_um[2] + (unit.z() < 0 ? -1e-6 : 1 + 1e-6) * box.size_um[2];
  }
  throw InternalError("no cell of the gel's block holds a point of it");
}

}  // namespace mbtfm::elements
