/// The exact half-space field of each ellipse plus a smooth finite element correction for the bottom and the sides.
///
/// u = u_c + w: u_c is the half-space's field, w solves the elastic problem without load on the surface, with w = -u_c
/// on the bottom and tractions -sigma(u_c) n on the sides. All of that is as smooth as the gel is thick, so a coarse
/// grid does, and it knows nothing of the adhesions: one factorisation for all scenes that cover the same squares.
/// Valid for a homogeneous gel with a flat surface; sides about a thickness away from the adhesions at least.
#include <Eigen/SparseCore>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <mutex>

#include "pipeline/contract/stopwatch.h"
#include "pipeline/numerics/quadrature.h"
#include "substrate/elements/linear.h"
#include "substrate/elements/models.h"
#include "substrate/elements/surface_loads.h"
#include "substrate/greens/columns.h"
#include "substrate/loads.h"
#include "substrate/models.h"
#include "substrate/response.h"
#include "substrate/scene.h"

namespace mbtfm::elements {
namespace {

/// Indices of the squares, of side thickness / cells_per_thickness, that the scene covers.
using Squares = std::array<int, 4>;

/// A quadrature point of a side of the block.
struct SidePoint {
  Eigen::Vector3d position_um;
  int normal_axis;
  double area_um2;  ///< with the sign of the outward normal
  std::vector<NodeWeight> weights;
};

/// Where a grid lies: the squares that are cut alike, and the sides.
struct Footprint {
  Squares squares;
  Extent outer;
};
struct SplitBlock {
  Footprint footprint;
  System system;
  Eigen::SparseMatrix<double> bottom_stiffness;  ///< rows: free unknowns; columns: those of the nodes held
  std::vector<SidePoint> side_points;
};

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

std::vector<SidePoint> side_points_of(const System& system) {
  const BlockMesh& mesh = system.block.boxes();
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
          Eigen::Vector3d unit;
          unit[axis] = end;
          unit[1 - axis] = 0.5 * (1 + gauss.nodes[g % 3]);
          unit[2] = 0.5 * (1 + gauss.nodes[g / 3]);
          SidePoint point{.position_um = {},
                          .normal_axis = axis,
                          .area_um2 = 0.25 * gauss.weights[g % 3] * gauss.weights[g / 3] * area,
                          .weights = system.space.weights_at({static_cast<int>(cell), unit})};
          for (int k = 0; k < 3; ++k) point.position_um[k] = box.low_um[k] + unit[k] * box.size_um[k];
          points.push_back(std::move(point));
        }
      }
    }
  }
  return points;
}

bool operator==(const Footprint& a, const Footprint& b) {
  const auto numbers = [](const Extent& e) { return std::array{e.low_um.x, e.low_um.y, e.high_um.x, e.high_um.y}; };
  return a.squares == b.squares && numbers(a.outer) == numbers(b.outer);
}

/// @throws NotSolved where the gel is so thin beside the scene that no grid of it fits
Footprint footprint_of(const Extent& scene, const Gel& gel, const substrate::SubstrateParameters& parameters) {
  const double step = gel.thickness_um / parameters.cells_per_thickness;
  substrate::check_size(scene, step, most_cells(parameters));
  const auto below = [step](double x) { return static_cast<int>(std::floor(x / step)); };
  const Squares s = {below(scene.low_um.x), below(scene.high_um.x) + 1, below(scene.low_um.y),
                     below(scene.high_um.y) + 1};
  const double margin = substrate::margin_um(gel, parameters);
  // the gel's own sides are where they are; far ones may be at whole squares, alike for many scenes
  const Extent from =
      parameters.side_distance_um ? scene : Extent{{s[0] * step, s[2] * step}, {s[1] * step, s[3] * step}};
  return {s, {from.low_um - Vec2{margin, margin}, from.high_um + Vec2{margin, margin}}};
}

/// @throws NotSolved where memory would not suffice
std::unique_ptr<SplitBlock> make_split_block(const Footprint& footprint, const Gel& gel,
                                             const substrate::SubstrateParameters& parameters, int threads) {
  const GridLines lines = grid_of(footprint, gel, parameters);
  const numerics::FactorOptions options = {.threads = threads,
                                           .memory_limit_GB = allowed_GB(parameters.memory_limit_GB),
                                           .cache_folder = parameters.cache_folder};
  Block grid(
      flat(gel.thickness_um), lines, [](const Box&) { return false; }, Sides::free, most_cells(parameters), threads);
  auto block = std::unique_ptr<SplitBlock>(new SplitBlock{footprint, System(std::move(grid), {}, {}, threads), {}, {}});
  System& system = block->system;
  const FreeNodes& nodes = system.space.nodes();
  std::vector<Eigen::Triplet<double>> bottom;
  const auto add_bottom = [&](int row, int node, const Eigen::Matrix3d& of_node) {
    for (int p = 0; p < 3; ++p) {
      for (int q = 0; q < 3; ++q) bottom.emplace_back(3 * row + p, 3 * nodes.held_index_of(node) + q, of_node(p, q));
    }
  };
  system.factor = system.space.factorise(box_stiffness_of({gel, {}}, system.block.boxes()), options, add_bottom);
  block->bottom_stiffness.resize(system.space.n_unknowns(), 3 * std::ssize(nodes.held()));
  block->bottom_stiffness.setFromTriplets(bottom.begin(), bottom.end());
  block->side_points = side_points_of(system);
  return block;
}

/// Averages the half-space's inner field over an ellipse, a force along x and y at once.
greens::PointForceField averaged_field(const Gel& gel, const substrate::Ellipse& ellipse,
                                       const std::vector<substrate::DiscPoint>& rule, const Eigen::Vector3d& position) {
  greens::PointForceField sum;
  const Vec2 offset = Vec2{position[0], position[1]} - ellipse.centre_um;
  for (const substrate::DiscPoint& p : rule) {
    const greens::PointForceField field =
        greens::cerruti_field(gel, offset.x - p.position.x, offset.y - p.position.y, position[2]);
    for (int f = 0; f < 2; ++f) {
      for (int i = 0; i < 3; ++i) {
        sum.u_um_per_nN[f][i] += p.weight * field.u_um_per_nN[f][i];
        for (int j = 0; j < 3; ++j) sum.gradient_per_nN[f][i][j] += p.weight * field.gradient_per_nN[f][i][j];
      }
    }
  }
  return sum;
}

/// With 2 cells of the grid over the thickness (notes/accuracy.md); it falls as the cube of their size.
constexpr double kErrorOfTwoCells = 1e-3;

substrate::SubstrateParameters with_cells_for(substrate::SubstrateParameters parameters, double tolerance) {
  const int cells = std::max(2, static_cast<int>(std::ceil(2 * std::cbrt(kErrorOfTwoCells / tolerance))));
  parameters.cells_per_thickness = std::max(parameters.cells_per_thickness, cells);
  return parameters;
}

/// Quadratic elements need two to follow the half-space field at the sides.
bool follows_sides(const Gel& gel, const substrate::SubstrateParameters& p) {
  return !p.side_distance_um || *p.side_distance_um / gel.thickness_um * p.cells_per_thickness >= 2;
}

class Split final : public substrate::Substrate {
 public:
  Split(const Gel& gel, const substrate::SubstrateParameters& parameters, int threads)
      : Substrate(parameters, kSplitCan), gel_(gel), threads_(threads) {}

  substrate::LazyResponse response(const substrate::Loads& loads,
                                   const substrate::Observations& observations) const override {
    const Scene scene{surface_points_of(observations), ellipses_of(loads)};
    const auto of = [=, this](Axes axes) {
      const Index rows = axes.n * std::ssize(scene.points_um);
      return substrate::lazy_response(
          {.rows = rows,
           .cols = 2 * static_cast<Index>(scene.ellipses.size()),
           .matrix = axes.n == 2 ? std::function([=, this] { return matrix(scene); }) : nullptr,
           .displace = [=, this](const MatrixXd& forces_nN) { return displaced(scene, axes, forces_nN); }});
    };
    switch (observations.components) {
      case substrate::Components::along:
        return of({0, 2});
      case substrate::Components::normal:
        return of({2, 1});
      case substrate::Components::all:
        break;
    }
    return joined(of({0, 2}), of({2, 1}));
  }

  double stated_error() const override { return kErrorOfTwoCells * std::pow(2.0 / parameters_.cells_per_thickness, 3); }

  Figures figures() const override {
    const std::lock_guard lock(mutex_);
    Figures figures = {{"substrate_model", "split"}, {"substrate_thickness_um", gel_.thickness_um}};
    if (!block_) return figures;
    const BlockMesh& boxes = block_->system.block.boxes();
    const GridLines& lines = boxes.lines;
    figures.emplace_back("substrate_unknowns", std::int64_t{block_->system.space.n_unknowns()});
    figures.emplace_back("substrate_elements", static_cast<std::int64_t>(boxes.cells.size()));
    figures.emplace_back("substrate_block_x_um", lines.x_um.back() - lines.x_um.front());
    figures.emplace_back("substrate_block_y_um", lines.y_um.back() - lines.y_um.front());
    figures.emplace_back("substrate_factor_GB", block_->system.factor->factor_GB());
    if (!parameters_.cache_folder.empty()) figures.emplace_back("substrate_cache", block_->system.factor->cache_note());
    figures.emplace_back("substrate_setup_s", setup_s_);
    figures.emplace_back("substrate_solve_s", solve_s_);
    return figures;
  }

 private:
  struct Scene {
    std::vector<Vec2> points_um;
    std::vector<substrate::Ellipse> ellipses;
  };

  MatrixXd matrix(const Scene& scene) const {
    const std::lock_guard lock(mutex_);
    MatrixXd matrix =
        greens::compliance_by_columns(scene.points_um, scene.ellipses, threads_,
                                      [this](const auto& ellipse) { return greens::HalfSpaceEllipse(gel_, ellipse); });
    if (matrix.size() > 0) add_correction(scene, MatrixXd::Identity(matrix.cols(), matrix.cols()), {0, 2}, matrix);
    return matrix;
  }

  /// By each column of forces: the near field, then the correction.
  MatrixXd displaced(const Scene& scene, Axes axes, const MatrixXd& forces_nN) const {
    MatrixXd field = MatrixXd::Zero(axes.n * std::ssize(scene.points_um), forces_nN.cols());
    if (field.size() == 0 || scene.ellipses.empty()) return field;
    const std::lock_guard lock(mutex_);
    for (Index column = 0; column < forces_nN.cols(); ++column) {
      const std::vector<Vec2> forces = substrate::vectors_of(forces_nN.col(column));
      field.col(column) = axes.n == 2 ? near_field(scene, forces) : near_normal(scene, forces);
    }
    add_correction(scene, forces_nN, axes, field);
    return field;
  }

  VectorXd near_field(const Scene& scene, const std::vector<Vec2>& forces_nN) const {
    std::vector<greens::HalfSpaceEllipse> near;
    for (const substrate::Ellipse& ellipse : scene.ellipses) near.emplace_back(gel_, ellipse);
    VectorXd field = VectorXd::Zero(2 * static_cast<Index>(scene.points_um.size()));
    numerics::parallel_for(static_cast<int>(scene.points_um.size()), threads_, [&](int i) {
      for (std::size_t j = 0; j < near.size(); ++j) {
        const greens::Sym2 g = near[j].compliance_um_per_nN(scene.points_um[i]);
        field[2 * i] += g.xx * forces_nN[j].x + g.xy * forces_nN[j].y;
        field[2 * i + 1] += g.xy * forces_nN[j].x + g.yy * forces_nN[j].y;
      }
    });
    return field;
  }

  VectorXd near_normal(const Scene& scene, const std::vector<Vec2>& forces_nN) const {
    const std::vector<double> near =
        greens::half_space_vertical_um(gel_, scene.points_um, scene.ellipses, forces_nN, threads_);
    return Eigen::Map<const VectorXd>(near.data(), static_cast<Index>(near.size()));
  }

  const SplitBlock& block_around(const Extent& scene) const {
    const Footprint footprint = footprint_of(scene, gel_, parameters_);
    if (block_ && block_->footprint == footprint) return *block_;
    block_.reset();  // not two at a time in memory
    const Stopwatch watch;
    block_ = make_split_block(footprint, gel_, parameters_, threads_);
    setup_s_ = watch.seconds();
    return *block_;
  }

  /// Add w at the points, along these axes, to the column of each column of forces.
  void add_correction(const Scene& scene, const MatrixXd& forces_nN, Axes axes, MatrixXd& columns) const {
    const SplitBlock& block = block_around(substrate::extent_of(scene.points_um, scene.ellipses));
    const Stopwatch watch;
    WeightedNodes samples(scene.points_um.size());
    numerics::parallel_for(static_cast<int>(samples.size()), threads_, [&](int i) {
      samples[i] = block.system.space.weights_at(block.system.block.on_surface(scene.points_um[i]));
    });
    block.system.factor->solve(
        static_cast<int>(columns.cols()), nodes_of(samples),
        [&](int column, const numerics::NodalColumn& b) {
          for (Index j = 0; j < std::ssize(scene.ellipses); ++j) {
            const Vec2 force{forces_nN(2 * j, column), forces_nN(2 * j + 1, column)};
            if (!(force == Vec2{})) add_data(block, scene.ellipses[j], force, b);
          }
        },
        [&](int column, const numerics::NodalColumn& w) { add_samples(samples, axes, w, columns.col(column).data()); });
    solve_s_ = watch.seconds();
  }

  /// Right-hand side of w for a force on one ellipse.
  void add_data(const SplitBlock& block, const substrate::Ellipse& ellipse, Vec2 force,
                const numerics::NodalColumn& b) const {
    // the field's nearest singularity seen from bottom and sides is about h away: leaves 1e-5 of it
    const double ratio = ellipse.semi_major_um / gel_.thickness_um;
    const int degree = ratio < 0.05 ? 3 : static_cast<int>(std::ceil(std::log(1e-5) / std::log(std::min(0.8, ratio))));
    const std::vector<substrate::DiscPoint> rule = substrate::ellipse_rule(ellipse, degree);
    const Space& space = block.system.space;
    const std::vector<int>& bottom = space.nodes().held();
    VectorXd on_bottom(3 * bottom.size());
    for (std::size_t k = 0; k < bottom.size(); ++k) {
      const auto field = averaged_field(gel_, ellipse, rule, space.mesh().position_um[bottom[k]]);
      for (int i = 0; i < 3; ++i) {
        on_bottom[3 * k + i] = force.x * field.u_um_per_nN[0][i] + force.y * field.u_um_per_nN[1][i];
      }
    }
    // w = -u_c there, on the left side
    const VectorXd data = block.bottom_stiffness * on_bottom;
    for (Index k = 0; k < data.size(); ++k) b(static_cast<int>(k / 3), static_cast<int>(k % 3)) += data[k];

    const double mu = substrate::shear_modulus_kPa(gel_);
    const double lambda = substrate::lame_modulus_kPa(gel_);
    for (const SidePoint& point : block.side_points) {
      const auto field = averaged_field(gel_, ellipse, rule, point.position_um);
      double g[3][3];
      for (int i = 0; i < 3; ++i) {
        for (int j = 0; j < 3; ++j) {
          g[i][j] = force.x * field.gradient_per_nN[0][i][j] + force.y * field.gradient_per_nN[1][i][j];
        }
      }
      const int n = point.normal_axis;
      for (int i = 0; i < 3; ++i) {
        const double stress = mu * (g[i][n] + g[n][i]) + (i == n ? lambda * (g[0][0] + g[1][1] + g[2][2]) : 0);
        for (const auto& [node, weight] : point.weights) b(node, i) -= point.area_um2 * weight * stress;
      }
    }
  }

  Gel gel_;
  int threads_;
  mutable std::mutex mutex_;  // guards the block: made at the first call, kept while scenes cover the same squares
  mutable std::unique_ptr<SplitBlock> block_;
  mutable double setup_s_ = 0, solve_s_ = 0;
};

}  // namespace

substrate::Model split() {
  return {.kind = substrate::ModelKind::split,
          .can = kSplitCan,
          .make = substrate::make_model<Split>,
          .within = with_cells_for,
          .follows = follows_sides};
}

}  // namespace mbtfm::elements
