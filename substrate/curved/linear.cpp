#include "substrate/curved/linear.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "pipeline/numerics/parallel.h"
#include "substrate/material.h"

namespace mbtfm::curved {

Eigen::Vector3d Field::displacement_um(const Location& location) const {
  return space->values_of(location.cell, at_nodes_um) * shapes_at(location.unit);
}

Eigen::Matrix3d Field::gradient(const Location& location) const {
  const Slopes slopes = unit_slopes_at(location.unit);
  const Eigen::Matrix3d jacobian = space->mesh().positions_of(location.cell) * slopes;
  return space->values_of(location.cell, at_nodes_um) * slopes * jacobian.inverse();
}

std::function<Eigen::MatrixXd(int cell)> linear_stiffness_of(const Gel& gel, const Mesh& mesh) {
  const double mu = substrate::shear_modulus_kPa(gel), lambda = substrate::lame_modulus_kPa(gel);
  return [=, &mesh](int cell) { return linear_stiffness(Element(mesh.positions_of(cell)), mu, lambda); };
}

Field solve_linear(const Gel& gel, std::shared_ptr<const Block> block, const Loading& loading,
                   const numerics::FactorOptions& options) {
  const auto space = std::make_shared<const Space>(block->mesh(), options.threads);
  const auto stiffness_of = linear_stiffness_of(gel, block->mesh());
  Vectors forces(space->nodes().size(), Eigen::Vector3d::Zero());
  if (loading.traction_kPa) forces = space->traction_forces_nN(loading.traction_kPa);
  if (loading.held_um) {
    const Vectors held = space->spread(Vectors(forces.size(), Eigen::Vector3d::Zero()), loading.held_um);
    const Vectors by_held = space->gather([&](int cell) -> NodeValues {
      const NodeValues u = space->values_of(cell, held);
      if (u.isZero()) return NodeValues::Zero();
      return NodeValues((stiffness_of(cell) * Eigen::Map<const Eigen::VectorXd>(u.data(), kUnknowns)).eval().data());
    });
    for (std::size_t k = 0; k < forces.size(); ++k) forces[k] -= by_held[k];
  }
  Vectors at_nodes = space->spread(solve(*space->factorise(stiffness_of, options), forces), loading.held_um);
  return {std::move(block), space, std::move(at_nodes)};
}

std::vector<double> gradient_gaps(const Field& field) {
  const Space& space = *field.space;
  const Mesh& mesh = space.mesh();
  using Gradients = std::vector<Eigen::Matrix3d>;
  Gradients mean(mesh.position_um.size(), Eigen::Matrix3d::Zero());
  std::vector<double> weight(mean.size(), 0);
  for (int cell = 0; cell < mesh.n_cells(); ++cell) {
    const double volume = std::abs(Element(mesh.positions_of(cell)).mass(0, 0));
    for (int k = 0; k < kNodes; ++k) {
      const int node = mesh.nodes_of(cell)[k];
      mean[node] += volume * field.gradient({cell, unit_of_node(k)});
      weight[node] += volume;
    }
  }
  for (std::size_t node = 0; node < mean.size(); ++node) mean[node] /= weight[node];
  Gradients continuous(mean.size(), Eigen::Matrix3d::Zero());
  for (std::size_t node = 0; node < mean.size(); ++node) {
    for (const auto& [carrier, share] : space.nodes().carriers(static_cast<int>(node))) {
      continuous[node] += share * mean[carrier];
    }
  }
  std::vector<double> gaps(mesh.n_cells());
  numerics::parallel_for(mesh.n_cells(), space.threads(), [&](int cell) {
    const NodePositions nodes = mesh.positions_of(cell);
    const Element element(nodes);
    const NodeValues u = space.values_of(cell, field.at_nodes_um);
    std::array<Eigen::Matrix3d, kNodes> at_node;
    double sum = 0;
    for (int k = 0; k < kNodes; ++k) at_node[k] = continuous[mesh.nodes_of(cell)[k]];
    for (const QuadraturePoint& point : element.points) {
      const int q = static_cast<int>(&point - element.points.data());
      Eigen::Matrix3d smooth = Eigen::Matrix3d::Zero();
      const Shapes& shapes = shapes_of_point(q);
      for (int k = 0; k < kNodes; ++k) smooth += shapes[k] * at_node[k];
      sum += point.volume_um3 * (u * point.slopes - smooth).squaredNorm();
    }
    const double side = (nodes.rowwise().maxCoeff() - nodes.rowwise().minCoeff()).maxCoeff();
    gaps[cell] = side * side * std::sqrt(sum);
  });
  return gaps;
}

namespace {

/// The cells with the largest gaps, until they hold most of the sum of squares, or would take too many unknowns.
/// @return whether there are any
bool mark(const Field& field, int most_unknowns, Marked& marked) {
  constexpr double kShare = 0.97;
  constexpr double kUnknownsOfMark = 7 * 24 * 1.1;  // seven cells more, and what neighbours halve with them
  const std::vector<double> gaps = gradient_gaps(field);
  std::vector<int> order(gaps.size());
  std::iota(order.begin(), order.end(), 0);
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return gaps[a] > gaps[b]; });
  double rest = 0, room = most_unknowns - field.space->n_unknowns();
  for (const double gap : gaps) rest += gap * gap;
  rest *= kShare;
  bool is_any = false;
  for (const int cell : order) {
    room -= kUnknownsOfMark;
    if (rest <= 0 || room < 0) break;
    is_any = true;
    rest -= gaps[cell] * gaps[cell];
    marked.add(field.block->boxes().cells[cell], field.block->boxes().cell_levels[cell]);
  }
  return is_any;
}

/// Whether a box of twice the size is too large: where any of its halves is.
bool has_marked_half(const Marked& marked, const boxes::Box& box) {
  for (int k = 0; k < 8; ++k) {
    boxes::Box half = box;
    for (int axis = 0; axis < 3; ++axis) {
      half.size_um[axis] /= 2;
      if (k >> axis & 1) half.low_um[axis] += half.size_um[axis];
    }
    if (marked.contains(half)) return true;
  }
  return false;
}

Vectors at_points(const Field& field, const std::vector<Vec3>& points_um) {
  Vectors values;
  for (const Vec3& point : points_um) values.push_back(field.displacement_um(field.block->locate(point)));
  return values;
}

/// Of the finer of two meshes, whose cells have half the side, where the error falls by five and more.
double estimated_error(const Vectors& coarse, const Vectors& fine) {
  constexpr double kFall = 5;
  double difference = 0, size = 0;
  for (std::size_t k = 0; k < fine.size(); ++k) {
    difference += (fine[k] - coarse[k]).squaredNorm();
    size += fine[k].squaredNorm();
  }
  return size == 0 ? 0 : std::sqrt(difference / size) / (kFall - 1);
}

}  // namespace

Adapted solve_adapted(const Gel& gel, const Shape& shape, const boxes::GridLines& lines, Sides sides,
                      const Loading& loading, const std::vector<Vec3>& points_um, const Adaptivity& adaptivity,
                      const numerics::FactorOptions& options) {
  constexpr std::int64_t kMostCells = 1'000'000;  // the unknowns are bounded before
  const auto solve_on = [&](const boxes::GridLines& on, const std::function<bool(const boxes::Box&)>& is_too_large) {
    const auto block = std::make_shared<const Block>(shape, on, is_too_large, sides, kMostCells, options.threads);
    return solve_linear(gel, block, loading, options);
  };
  Marked marked(lines);
  const auto is_marked = [&](const boxes::Box& box) { return marked.contains(box); };
  const auto has_half = [&](const boxes::Box& box) { return has_marked_half(marked, box); };
  Adapted adapted{solve_on(lines, is_marked)};
  while (true) {
    Marked finer = marked;
    const bool is_last = 4 * adapted.field.space->n_unknowns() > 3 * adaptivity.most_unknowns ||
                         !mark(adapted.field, adaptivity.most_unknowns, finer);
    if (is_last || adaptivity.tolerance > 0) {
      const Field coarse = solve_on(every_second(lines), has_half);
      adapted.estimated_error = estimated_error(at_points(coarse, points_um), at_points(adapted.field, points_um));
      if (is_last || adapted.estimated_error <= adaptivity.tolerance) return adapted;
    }
    marked = std::move(finer);
    adapted.field = solve_on(lines, is_marked);
  }
}

std::vector<double> layers_um(double depth_um, int n) {
  constexpr double kGrowth = 1.4;
  std::vector<double> lines;
  for (int k = 0; k <= n; ++k) lines.push_back(depth_um * (std::pow(kGrowth, k) - 1) / (std::pow(kGrowth, n) - 1));
  lines.back() = depth_um;
  return lines;
}

}  // namespace mbtfm::curved
