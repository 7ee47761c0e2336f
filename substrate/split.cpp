/// The exact half-space field of each ellipse plus a smooth finite element correction for the bottom and the sides.
///
/// u = u_c + w: u_c is the half-space's field, w solves the elastic problem without load on the surface, with w = -u_c
/// on the bottom and tractions -sigma(u_c) n on the sides. All of that is as smooth as the gel is thick, so a coarse
/// grid does, and it knows nothing of the adhesions: one factorisation for all scenes that cover the same squares.
/// Valid for a homogeneous gel with a flat surface; sides about a thickness away from the adhesions at least.
#include <array>
#include <chrono>
#include <cmath>
#include <memory>
#include <mutex>

#include "pipeline/contract/errors.h"
#include "substrate/elastic_system.h"
#include "substrate/greens_model.h"
#include "substrate/models.h"
#include "substrate/scene.h"

namespace mbtfm::substrate {
namespace {

/// Indices of the squares, of side thickness / cells_per_thickness, that the scene covers.
using Squares = std::array<int, 4>;

/// A quadrature point of a side of the block.
struct SidePoint {
  std::array<double, 3> position_um;
  int normal_axis;
  double area_um2;  ///< with the sign of the outward normal
  std::vector<NodeWeight> weights;
};

struct Block {
  Squares squares;
  ElasticSystem system;
  std::vector<SidePoint> side_points;
};

/// Lines at index_low … index_high times `step`, then towards either side growing steps over `margin`.
std::vector<double> lines_of(int index_low, int index_high, double step, double margin) {
  constexpr double kGrowth = 1.5;  // the correction fades over distances that grow with the distance itself
  std::vector<double> growing;
  double reach = 0;
  for (double size = step; reach < margin; size *= kGrowth) growing.push_back(reach += size);
  std::vector<double> lines;
  for (auto d = growing.rbegin(); d != growing.rend(); ++d) lines.push_back(index_low * step - *d * margin / reach);
  for (int index = index_low; index <= index_high; ++index) lines.push_back(index * step);
  for (const double d : growing) lines.push_back(index_high * step + d * margin / reach);
  return lines;
}

GridLines grid_of(const Squares& squares, const Gel& gel, const SubstrateParameters& parameters) {
  const double step = gel.thickness_um / parameters.cells_per_thickness;
  const double margin = parameters.margin_thicknesses * gel.thickness_um;
  GridLines lines;
  lines.x_um = lines_of(squares[0], squares[1], step, margin);
  lines.y_um = lines_of(squares[2], squares[3], step, margin);
  for (int k = 0; k <= parameters.cells_per_thickness; ++k) lines.z_um.push_back(k * step);
  lines.z_um.back() = gel.thickness_um;
  return lines;
}

/// Memory before anything is built: 45 kB an element are too few for any grid of Q2 (measured: 90 to 300).
std::int64_t most_cells(const SubstrateParameters& parameters) {
  return static_cast<std::int64_t>(allowed_GB(parameters.memory_limit_GB) / 45e-6);
}

void check_size(const GridLines& lines, std::int64_t most) {
  const auto n = [](const std::vector<double>& line) { return static_cast<std::int64_t>(line.size()) - 1; };
  const std::int64_t n_cells = n(lines.x_um) * n(lines.y_um) * n(lines.z_um);
  if (n_cells <= most) return;
  throw NotSolved(Report{.reason = "the gel is so thin beside the scene that its grid has " + std::to_string(n_cells) +
                                   " elements, which the memory allowed does not take: take the model 'layer'"});
}

std::vector<SidePoint> side_points_of(const ElasticSystem& system) {
  const BlockMesh& mesh = system.mesh();
  const GaussRule gauss = gauss_legendre(3);
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

/// Averages the half-space's inner field over an ellipse, a force along x and y at once.
PointForceField averaged_field(const Gel& gel, const Ellipse& ellipse, const std::vector<DiscPoint>& rule,
                               const std::array<double, 3>& position) {
  PointForceField sum;
  const Vec2 offset = Vec2{position[0], position[1]} - ellipse.centre_um;
  for (const DiscPoint& p : rule) {
    const PointForceField field = cerruti_field(gel, offset.x - p.position.x, offset.y - p.position.y, position[2]);
    for (int f = 0; f < 2; ++f) {
      for (int i = 0; i < 3; ++i) {
        sum.u_um_per_nN[f][i] += p.weight * field.u_um_per_nN[f][i];
        for (int j = 0; j < 3; ++j) sum.gradient_per_nN[f][i][j] += p.weight * field.gradient_per_nN[f][i][j];
      }
    }
  }
  return sum;
}

class Split final : public Substrate {
 public:
  Split(const Gel& gel, const SubstrateParameters& parameters, int threads)
      : gel_(gel), parameters_(parameters), threads_(threads) {}

  Eigen::MatrixXd compliance_um_per_nN(const std::vector<Vec2>& points_um,
                                       const std::vector<Ellipse>& ellipses) const override {
    const std::lock_guard lock(mutex_);
    Eigen::MatrixXd matrix = near_field(points_um, ellipses);
    if (matrix.size() == 0) return matrix;
    const auto force_of = [](int column) {
      return std::vector<std::pair<int, Vec2>>{{column / 2, column % 2 == 0 ? Vec2{1, 0} : Vec2{0, 1}}};
    };
    add_correction(points_um, ellipses, static_cast<int>(matrix.cols()), force_of, matrix);
    return matrix;
  }

  std::vector<Vec2> displacements_um(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses,
                                     const std::vector<Vec2>& forces_nN) const override {
    check_forces(ellipses, forces_nN);
    std::vector<Vec2> displacements(points_um.size());
    if (points_um.empty() || ellipses.empty()) return displacements;
    const std::lock_guard lock(mutex_);
    std::vector<std::pair<int, Vec2>> all;
    for (std::size_t j = 0; j < forces_nN.size(); ++j) all.emplace_back(static_cast<int>(j), forces_nN[j]);
    Eigen::MatrixXd field = Eigen::MatrixXd::Zero(2 * points_um.size(), 1);
    parallel_for(static_cast<int>(points_um.size()), threads_, [&](int i) {
      for (const auto& [j, force] : all) {
        const Sym2 g = HalfSpaceEllipse(gel_, ellipses[j]).compliance_um_per_nN(points_um[i]);
        field(2 * i, 0) += g.xx * force.x + g.xy * force.y;
        field(2 * i + 1, 0) += g.xy * force.x + g.yy * force.y;
      }
    });
    add_correction(
        points_um, ellipses, 1, [&all](int) { return all; }, field);
    for (std::size_t i = 0; i < points_um.size(); ++i) displacements[i] = {field(2 * i, 0), field(2 * i + 1, 0)};
    return displacements;
  }

  std::vector<Effect> effects() const override {
    return {{.name = "finite thickness", .is_on = true, .why = "split: finite element correction for the rigid base"},
            {.name = "finite sides",
             .is_on = true,
             .why = "split: free sides " + std::to_string(parameters_.margin_thicknesses) +
                    " thicknesses beyond adhesions and beads; further away they would change less than 0.1 %"},
            vertical_displacement_off()};
  }

  Figures figures() const override {
    const std::lock_guard lock(mutex_);
    Figures figures = {{"substrate_model", "split"}, {"substrate_thickness_um", gel_.thickness_um}};
    if (!block_) return figures;
    const GridLines& lines = block_->system.mesh().lines;
    figures.emplace_back("substrate_unknowns", std::int64_t{block_->system.n_unknowns()});
    figures.emplace_back("substrate_elements", static_cast<std::int64_t>(block_->system.mesh().cells.size()));
    figures.emplace_back("substrate_block_x_um", lines.x_um.back() - lines.x_um.front());
    figures.emplace_back("substrate_block_y_um", lines.y_um.back() - lines.y_um.front());
    figures.emplace_back("substrate_factor_GB", block_->system.factor().factor_GB());
    figures.emplace_back("substrate_setup_s", setup_s_);
    figures.emplace_back("substrate_solve_s", solve_s_);
    return figures;
  }

 private:
  Eigen::MatrixXd near_field(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses) const {
    return compliance_by_columns(points_um, ellipses, threads_,
                                 [this](const Ellipse& ellipse) { return HalfSpaceEllipse(gel_, ellipse); });
  }

  const Block& block_around(const Extent& scene) const {
    const double step = gel_.thickness_um / parameters_.cells_per_thickness;
    const auto below = [step](double x) { return static_cast<int>(std::floor(x / step)); };
    Squares squares = {below(scene.low_um.x), below(scene.high_um.x) + 1, below(scene.low_um.y),
                       below(scene.high_um.y) + 1};
    if (block_ && block_->squares == squares) return *block_;
    block_.reset();  // not two at a time in memory
    const auto start = std::chrono::steady_clock::now();
    const GridLines lines = grid_of(squares, gel_, parameters_);
    const std::int64_t most = most_cells(parameters_);
    check_size(lines, most);
    BlockMesh mesh = make_block_mesh(
        lines, 2, [](const Box&) { return false; }, most, threads_);
    block_ = std::unique_ptr<Block>(
        new Block{squares, ElasticSystem(gel_, std::move(mesh), threads_, 1, parameters_.memory_limit_GB), {}});
    block_->side_points = side_points_of(block_->system);
    setup_s_ = seconds_since(start);
    return *block_;
  }

  /// Add w at the points to each column, whose forces on ellipses are given by `forces_of`.
  template <class ForcesOf>
  void add_correction(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses, int n_columns,
                      const ForcesOf& forces_of, Eigen::MatrixXd& columns) const {
    check_points(points_um);
    check(ellipses);
    const Block& block = block_around(extent_of(points_um, ellipses));
    const auto start = std::chrono::steady_clock::now();
    std::vector<std::vector<NodeWeight>> samples(points_um.size());
    parallel_for(static_cast<int>(samples.size()), threads_,
                 [&](int i) { samples[i] = block.system.surface_weights(points_um[i]); });
    block.system.factor().solve(
        n_columns,
        [&](int column, double* b) {
          for (const auto& [j, force] : forces_of(column)) add_data(block, ellipses[j], force, b);
        },
        [&](int column, const double* w) {
          for (std::size_t i = 0; i < samples.size(); ++i) {
            for (const auto& [node, weight] : samples[i]) {
              columns(2 * i, column) += weight * w[3 * node];
              columns(2 * i + 1, column) += weight * w[3 * node + 1];
            }
          }
        });
    solve_s_ = seconds_since(start);
  }

  /// Right-hand side of w for a force on one ellipse.
  void add_data(const Block& block, const Ellipse& ellipse, Vec2 force, double* b) const {
    // the field's nearest singularity seen from bottom and sides is about h away: leaves 1e-5 of it
    const double ratio = ellipse.semi_major_um / gel_.thickness_um;
    const int degree = ratio < 0.05 ? 3 : static_cast<int>(std::ceil(std::log(1e-5) / std::log(std::min(0.8, ratio))));
    const std::vector<DiscPoint> rule = ellipse_rule(ellipse, degree);
    const ElasticSystem& system = block.system;
    const std::vector<int>& bottom = system.bottom_nodes();
    Eigen::VectorXd on_bottom(3 * bottom.size());
    for (std::size_t k = 0; k < bottom.size(); ++k) {
      const auto field = averaged_field(gel_, ellipse, rule, system.mesh().position_um[bottom[k]]);
      for (int i = 0; i < 3; ++i) {
        on_bottom[3 * k + i] = force.x * field.u_um_per_nN[0][i] + force.y * field.u_um_per_nN[1][i];
      }
    }
    // w = -u_c there, on the left side
    Eigen::Map<Eigen::VectorXd>(b, system.n_unknowns()) += system.bottom_stiffness() * on_bottom;

    const double mu = shear_modulus_kPa(gel_);
    const double lambda = 2 * mu * gel_.poisson_ratio / (1 - 2 * gel_.poisson_ratio);
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
        for (const auto& [node, weight] : point.weights) b[3 * node + i] -= point.area_um2 * weight * stress;
      }
    }
  }

  Gel gel_;
  SubstrateParameters parameters_;
  int threads_;
  mutable std::mutex
      mutex_;  // guards what follows: made at the first call, kept while the scene covers the same squares
  mutable std::unique_ptr<Block> block_;
  mutable double setup_s_ = 0, solve_s_ = 0;
};

}  // namespace

std::unique_ptr<Substrate> make_split(const Gel& gel, const SubstrateParameters& parameters, int threads) {
  return std::make_unique<Split>(gel, parameters, threads);
}

}  // namespace mbtfm::substrate
