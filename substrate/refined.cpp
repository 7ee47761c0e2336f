/// Locally refined finite elements: no closed form anywhere, so what the others are checked against, at a price.
#include <algorithm>
#include <array>
#include <cmath>
#include <mutex>
#include <numbers>
#include <numeric>

#include "pipeline/contract/csv.h"
#include "pipeline/contract/errors.h"
#include "substrate/elastic_system.h"
#include "substrate/ellipse_load.h"
#include "substrate/greens_model.h"
#include "substrate/load_cases.h"
#include "substrate/models.h"
#include "substrate/scene.h"

namespace mbtfm::substrate {
namespace {

using std::numbers::pi;

/// Cubes of the gel's thickness around the scene and its margin.
GridLines cubes_around(const Extent& scene, const Gel& gel, double margin_thicknesses) {
  const double h = gel.thickness_um;
  const auto line = [&](double low, double high) {
    const int n = static_cast<int>(std::ceil((high - low) / h + 2 * margin_thicknesses));
    std::vector<double> values;
    for (int k = 0; k <= n; ++k) values.push_back(0.5 * (low + high) + (k - 0.5 * n) * h);
    return values;
  };
  return {line(scene.low_um.x, scene.high_um.x), line(scene.low_um.y, scene.high_um.y), {0, h}};
}

/// Elements of a uniform grid that an ellipse touches.
int n_touched(const Ellipse& ellipse, Vec2 origin, double side) {
  const Vec2 half = half_extent_um(ellipse);
  const auto index = [side](double x) { return std::floor(x / side); };
  const Vec2 low = ellipse.centre_um - half - origin;
  const Vec2 high = ellipse.centre_um + half - origin;
  int n = 0;
  for (double j = index(low.y); j <= index(high.y); ++j) {
    for (double i = index(low.x); i <= index(high.x); ++i) {
      const Vec2 corner = origin + Vec2{i * side, j * side};
      if (!clipped_ellipse_rule(ellipse, {corner, corner + Vec2{side, side}}).empty()) ++n;
    }
  }
  return n;
}

/// An ellipse with the side of element it asks for, covered by discs of its semi-minor axis along its major one.
struct Target {
  double side_um, radius_um;
  std::vector<Vec2> centres_um;
};

Target target_of(const Ellipse& ellipse, const GridLines& lines, const SubstrateParameters& parameters) {
  const double wanted =
      std::sqrt(pi * ellipse.semi_major_um * ellipse.semi_minor_um) / parameters.elements_across_adhesion;
  double side = lines.z_um.back();
  const Vec2 origin = {lines.x_um.front(), lines.y_um.front()};
  while (side > wanted || n_touched(ellipse, origin, side) < parameters.elements_per_adhesion) side /= 2;

  const double b = ellipse.semi_minor_um;
  const double reach = std::max(0.0, ellipse.semi_major_um - b);
  const int n = static_cast<int>(std::ceil(reach / b));
  const Vec2 along = {std::cos(ellipse.angle_rad), std::sin(ellipse.angle_rad)};
  Target target{.side_um = side, .radius_um = b, .centres_um = {}};
  for (int k = -n; k <= n; ++k) target.centres_um.push_back(ellipse.centre_um + (n == 0 ? 0 : reach * k / n) * along);
  return target;
}

/// Columns of the matrix, those of neighbouring ellipses side by side: along a Z-shaped (Morton) curve of 1024 x 1024.
std::vector<int> columns_by_place(const std::vector<Ellipse>& ellipses) {
  const Extent extent = extent_of({}, ellipses);
  const Vec2 size = extent.high_um - extent.low_um;
  const auto key = [&](int column) {
    const Vec2 at = ellipses[column / 2].centre_um - extent.low_um;
    const auto x = static_cast<unsigned>(1023 * at.x / size.x), y = static_cast<unsigned>(1023 * at.y / size.y);
    unsigned bits = 0;
    for (unsigned b = 0; b < 10; ++b) bits |= (x >> b & 1) << 2 * b | (y >> b & 1) << (2 * b + 1);
    return bits;
  };
  std::vector<int> columns(2 * ellipses.size());
  std::iota(columns.begin(), columns.end(), 0);
  std::stable_sort(columns.begin(), columns.end(), [&](int a, int b) { return key(a) < key(b); });
  return columns;
}

double distance(const Box& box, Vec2 point) {
  const auto outside = [](double low, double size, double x) { return std::max({0.0, low - x, x - low - size}); };
  const double dx = outside(box.low_um[0], box.size_um[0], point.x);
  const double dy = outside(box.low_um[1], box.size_um[1], point.y);
  return std::sqrt(dx * dx + dy * dy + box.low_um[2] * box.low_um[2]);
}

class Refined final : public Substrate {
 public:
  Refined(const Gel& gel, const SubstrateParameters& parameters, int threads)
      : gel_(gel), parameters_(parameters), threads_(threads), order_(parameters.element == "q1-p0" ? 1 : 2) {}

  Eigen::MatrixXd compliance_um_per_nN(const std::vector<Vec2>& points_um,
                                       const std::vector<Ellipse>& ellipses) const override {
    Eigen::MatrixXd matrix = Eigen::MatrixXd::Zero(2 * points_um.size(), 2 * ellipses.size());
    solve(points_um, ellipses, unit_case, matrix);
    return matrix;
  }

  std::vector<Vec2> displacements_um(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses,
                                     const std::vector<Vec2>& forces_nN) const override {
    check_forces(ellipses, forces_nN);
    Eigen::MatrixXd field = Eigen::MatrixXd::Zero(2 * points_um.size(), 1);
    const LoadCase all = case_of(forces_nN);
    solve(
        points_um, ellipses, [&all](int) { return all; }, field);
    return vectors_of(field);
  }

  std::vector<Effect> effects() const override {
    return {{.name = "finite thickness", .is_on = true, .why = "refined: elements down to the rigid base"},
            {.name = "finite sides",
             .is_on = true,
             .why = "refined: free sides " + brief(parameters_.margin_thicknesses) +
                    " thicknesses beyond adhesions and beads"},
            vertical_displacement_off()};
  }

  Figures figures() const override {
    const std::lock_guard lock(mutex_);
    return figures_;
  }

 private:
  BlockMesh mesh_for(const Extent& scene, const std::vector<Ellipse>& ellipses) const {
    // too few for any mesh of the kind (measured: 250 kB an element of Q2, 25 of Q1); the factor is weighed exactly
    const double bytes = order_ == 2 ? 1e5 : 1e4;
    const auto most = static_cast<std::int64_t>(1e9 * allowed_GB(parameters_.memory_limit_GB) / bytes);
    check_size(scene, gel_.thickness_um, most);
    const GridLines lines = cubes_around(scene, gel_, parameters_.margin_thicknesses);
    std::vector<Target> targets;
    for (const Ellipse& ellipse : ellipses) targets.push_back(target_of(ellipse, lines, parameters_));
    const auto is_too_large = [&](const Box& box) {
      const double side = box.size_um[0];
      for (const Target& target : targets) {
        // the side grows with the distance: the field's own scale
        if (side <= target.side_um * (1 + 1e-9)) continue;
        for (const Vec2 centre : target.centres_um) {
          if (side > parameters_.growth * (distance(box, centre) - target.radius_um)) return true;
        }
      }
      return false;
    };
    return make_block_mesh(lines, order_, is_too_large, most, threads_);
  }

  template <class CaseOf>
  void solve(const std::vector<Vec2>& points_um, const std::vector<Ellipse>& ellipses, const CaseOf& case_of_column,
             Eigen::MatrixXd& columns) const {
    check_points(points_um);
    check(ellipses);
    if (columns.size() == 0 || ellipses.empty()) return;
    const auto start = std::chrono::steady_clock::now();
    const Extent scene = extent_of(points_um, ellipses);
    const ElasticSystem system(gel_, mesh_for(scene, ellipses), threads_, parameters_.memory_limit_GB);
    const double setup_s = seconds_since(start);
    std::vector<std::vector<NodeWeight>> samples(points_um.size()), loads(ellipses.size());
    parallel_for(static_cast<int>(samples.size()), threads_,
                 [&](int i) { samples[i] = system.surface_weights(points_um[i]); });
    parallel_for(static_cast<int>(loads.size()), threads_, [&](int j) { loads[j] = system.load_weights(ellipses[j]); });
    const std::vector<int> order = columns.cols() == 1 ? std::vector<int>{0} : columns_by_place(ellipses);
    system.factor().solve(
        static_cast<int>(columns.cols()), nodes_of(samples),
        [&](int k, const NodalColumn& b) {
          for (const auto& [j, force] : case_of_column(order[k])) {
            for (const auto& [node, weight] : loads[j]) {
              b(node, 0) += weight * force.x;
              b(node, 1) += weight * force.y;
            }
          }
        },
        [&](int k, const NodalColumn& u) { add_samples(samples, u, columns.col(order[k]).data()); });
    note(system, ellipses, setup_s, seconds_since(start));
  }

  void note(const ElasticSystem& system, const std::vector<Ellipse>& ellipses, double setup_s, double total_s) const {
    std::size_t fewest = system.mesh().cells.size();
    for (const Ellipse& ellipse : ellipses) fewest = std::min(fewest, system.touched_cells(ellipse).size());
    const GridLines& lines = system.mesh().lines;
    const std::lock_guard lock(mutex_);
    figures_ = {{"substrate_model", "refined"},
                {"substrate_element", parameters_.element},
                {"substrate_thickness_um", gel_.thickness_um},
                {"substrate_unknowns", std::int64_t{system.n_unknowns()}},
                {"substrate_elements", static_cast<std::int64_t>(system.mesh().cells.size())},
                {"substrate_fewest_elements_of_an_adhesion", static_cast<std::int64_t>(fewest)},
                {"substrate_block_x_um", lines.x_um.back() - lines.x_um.front()},
                {"substrate_block_y_um", lines.y_um.back() - lines.y_um.front()},
                {"substrate_factor_GB", system.factor().factor_GB()},
                {"substrate_setup_s", setup_s},
                {"substrate_total_s", total_s}};
  }

  Gel gel_;
  SubstrateParameters parameters_;
  int threads_;
  int order_;
  mutable std::mutex mutex_;
  mutable Figures figures_ = {{"substrate_model", "refined"}};  // of the last call
};

}  // namespace

std::unique_ptr<Substrate> make_refined(const Gel& gel, const SubstrateParameters& parameters, int threads) {
  return std::make_unique<Refined>(gel, parameters, threads);
}

}  // namespace mbtfm::substrate
