#include "substrate/boxes/split_block.h"

#include <cmath>

#include "pipeline/numerics/quadrature.h"
#include "substrate/models.h"
#include "substrate/scene.h"

namespace mbtfm::boxes {
namespace {

/// Steps that grow from `step` until they fill `reach`: their ends.
std::vector<double> growing_steps(double step, double reach) {
  constexpr double kGrowth = 1.5;  // the correction fades over distances that grow with the distance itself
  std::vector<double> ends;
  double end = 0;
  for (double size = step; end < reach * (1 - 1e-9); size *= kGrowth) ends.push_back(end += size);
  for (double& e : ends) e *= reach / end;
  return ends;
}

/// Lines at index_low … index_high times `step`, then towards either side growing steps.
std::vector<double> lines_of(int index_low, int index_high, double step, double low, double high) {
  // near sides may cut squares: no slivers
  while (index_low * step - low < 0.25 * step && index_low < index_high) ++index_low;
  while (high - index_high * step < 0.25 * step && index_high > index_low) --index_high;
  std::vector<double> lines;
  const std::vector<double> before = growing_steps(step, index_low * step - low);
  for (auto d = before.rbegin(); d != before.rend(); ++d) lines.push_back(index_low * step - *d);
  for (int index = index_low; index <= index_high; ++index) lines.push_back(index * step);
  for (const double d : growing_steps(step, high - index_high * step)) lines.push_back(index_high * step + d);
  return lines;
}

GridLines grid_of(const Footprint& footprint, const Gel& gel, const substrate::SubstrateParameters& parameters) {
  const double step = gel.thickness_um / parameters.cells_per_thickness;
  const auto& [squares, outer] = footprint;
  GridLines lines;
  lines.x_um = lines_of(squares[0], squares[1], step, outer.low_um.x, outer.high_um.x);
  lines.y_um = lines_of(squares[2], squares[3], step, outer.low_um.y, outer.high_um.y);
  for (int k = 0; k <= parameters.cells_per_thickness; ++k) lines.z_um.push_back(k * step);
  lines.z_um.back() = gel.thickness_um;
  return lines;
}

/// Memory before anything is built: 45 kB an element are too few for any grid of Q2 (measured: 90 to 300).
std::int64_t most_cells(const substrate::SubstrateParameters& parameters) {
  return static_cast<std::int64_t>(allowed_GB(parameters.memory_limit_GB) / 45e-6);
}

std::vector<SidePoint> side_points_of(const ElasticSystem& system) {
  const BlockMesh& mesh = system.mesh();
  const numerics::GaussRule gauss = numerics::gauss_legendre(3);
  std::vector<SidePoint> points;
  for (std::size_t cell = 0; cell < mesh.cells.size(); ++cell) {
    const Box& box = mesh.cells[cell];
    for (int axis = 0; axis < 2; ++axis) {
      const std::vector<double>& lines = axis == 0 ? mesh.lines.x_um : mesh.lines.y_um;
      const double tiny = 1e-6 * box.size_um[axis];
      for (int end = 0; end < 2; ++end) {
        const double face = box.low_um[axis] + end * box.size_um[axis];
        if (std::abs(face - (end == 0 ? lines.front() : lines.back())) > tiny) continue;
        const double area = (end == 0 ? -1 : 1) * box.size_um[1 - axis] * box.size_um[2];
        for (int g = 0; g < 9; ++g) {
          std::array<double, 3> unit;
          unit[axis] = end;
          unit[1 - axis] = 0.5 * (1 + gauss.nodes[g % 3]);
          unit[2] = 0.5 * (1 + gauss.nodes[g / 3]);
          SidePoint point{.position_um = {},
                          .normal_axis = axis,
                          .area_um2 = 0.25 * gauss.weights[g % 3] * gauss.weights[g / 3] * area,
                          .weights = system.cell_weights(static_cast<int>(cell), unit)};
          for (int k = 0; k < 3; ++k) point.position_um[k] = box.low_um[k] + unit[k] * box.size_um[k];
          points.push_back(std::move(point));
        }
      }
    }
  }
  return points;
}

}  // namespace

bool operator==(const Footprint& a, const Footprint& b) {
  const auto numbers = [](const substrate::Extent& e) {
    return std::array{e.low_um.x, e.low_um.y, e.high_um.x, e.high_um.y};
  };
  return a.squares == b.squares && numbers(a.outer) == numbers(b.outer);
}

Footprint footprint_of(const substrate::Extent& scene, const Gel& gel,
                       const substrate::SubstrateParameters& parameters) {
  const double step = gel.thickness_um / parameters.cells_per_thickness;
  substrate::check_size(scene, step, most_cells(parameters));
  const auto below = [step](double x) { return static_cast<int>(std::floor(x / step)); };
  const Squares s = {below(scene.low_um.x), below(scene.high_um.x) + 1, below(scene.low_um.y),
                     below(scene.high_um.y) + 1};
  const double margin = substrate::margin_um(gel, parameters);
  // the gel's own sides stand where they do; far ones may stand at whole squares, alike for many scenes
  const substrate::Extent from =
      parameters.side_distance_um ? scene : substrate::Extent{{s[0] * step, s[2] * step}, {s[1] * step, s[3] * step}};
  return {s, {from.low_um - Vec2{margin, margin}, from.high_um + Vec2{margin, margin}}};
}

std::unique_ptr<SplitBlock> make_split_block(const Footprint& footprint, const Gel& gel,
                                             const substrate::SubstrateParameters& parameters, int threads) {
  const GridLines lines = grid_of(footprint, gel, parameters);
  BlockMesh mesh = make_block_mesh(
      lines, 2, [](const Box&) { return false; }, most_cells(parameters), threads);
  const numerics::FactorOptions options = {.threads = threads,
                                           .memory_limit_GB = allowed_GB(parameters.memory_limit_GB),
                                           .cache_folder = parameters.cache_folder};
  auto block =
      std::unique_ptr<SplitBlock>(new SplitBlock{footprint, ElasticSystem({gel, {}}, std::move(mesh), options), {}});
  block->side_points = side_points_of(block->system);
  return block;
}

}  // namespace mbtfm::boxes
