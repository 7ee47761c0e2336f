/// A gel under a surface that is not flat: finite elements bent onto it.
#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/report.h"
#include "pipeline/contract/stopwatch.h"
#include "pipeline/numerics/parallel.h"
#include "substrate/effects.h"
#include "substrate/elements/linear.h"
#include "substrate/elements/models.h"
#include "substrate/elements/neo_hooke.h"
#include "substrate/elements/surface_loads.h"
#include "substrate/elements/volume.h"
#include "substrate/ellipse.h"
#include "substrate/response.h"
#include "substrate/scene.h"
#include "substrate/surface/height.h"

namespace mbtfm::elements {
namespace {

/// How fine a mesh is.
struct Fineness {
  double across;         ///< of targets_of
  double growth;         ///< of a cell's side over its distance to the nearest load, at most
  int layers = 2;        ///< of the coarsest cells over the gel's depth
  double misfit = 0.01;  ///< of the mesh to the surface, over the side and the distance, at most

  Fineness coarser() const { return {across / 2, growth * kFarStep, std::max(1, layers / 2), 8 * misfit}; }
  Fineness finer() const { return {across * 2, growth / kFarStep, layers, misfit / 8}; }

 private:
  // at a patch's rim the error falls as the side to the power 3/2, far away as its cube: there it may shrink less
  static constexpr double kFarStep = std::numbers::sqrt2;
};

/// By the factor of a tangent, on a mesh.
class FactoredResponse final : public substrate::Response {
 public:
  FactoredResponse(std::shared_ptr<const System> system, std::shared_ptr<const numerics::SparseCholesky> factor,
                   Axes load_axes, Axes point_axes)
      : system_(std::move(system)), factor_(std::move(factor)), load_axes_(load_axes), point_axes_(point_axes) {}

  Index rows() const override { return point_axes_.n * std::ssize(system_->points); }
  Index cols() const override { return load_axes_.n * std::ssize(system_->loads); }
  MatrixXd displace(const MatrixXd& forces) const override {
    return solve_between(*factor_, system_->loads, load_axes_, forces, system_->points, point_axes_);
  }
  MatrixXd pull_back(const MatrixXd& displacements) const override {
    return solve_between(*factor_, system_->points, point_axes_, displacements, system_->loads, load_axes_);
  }
  MatrixXd matrix() const override {
    if (cols() <= rows()) return displace(MatrixXd::Identity(cols(), cols()));
    return pull_back(MatrixXd::Identity(rows(), rows())).transpose();
  }
  substrate::SharedResponse kept() const override {
    return substrate::dense_response(matrix(), system_->space.threads());
  }

 private:
  std::shared_ptr<const System> system_;
  std::shared_ptr<const numerics::SparseCholesky> factor_;
  Axes load_axes_, point_axes_;
};

class CurvedGel;

class CurvedResponse final : public substrate::Response {
 public:
  CurvedResponse(const CurvedGel& gel, substrate::Loads loads, substrate::Observations observations)
      : gel_(gel), loads_(std::move(loads)), observations_(std::move(observations)) {}

  Index rows() const override { return observations_.n_components() * observations_.size(); }
  Index cols() const override { return loads_.n_components * loads_.size(); }
  MatrixXd displace(const MatrixXd& forces) const override;
  MatrixXd pull_back(const MatrixXd& displacements) const override {
    MBTFM_ASSERT(displacements.rows() == rows());
    return is_empty() ? MatrixXd::Zero(cols(), displacements.cols()) : at_rest().pull_back(displacements);
  }
  MatrixXd matrix() const override { return is_empty() ? MatrixXd::Zero(rows(), cols()) : at_rest().matrix(); }
  substrate::SharedResponse kept() const override;
  substrate::Tangent about(const VectorXd& forces) const override;

 private:
  bool is_empty() const { return rows() == 0 || cols() == 0; }
  Axes load_axes() const { return {0, loads_.n_components}; }
  Axes point_axes() const {
    return {observations_.components == substrate::Components::normal ? 2 : 0, observations_.n_components()};
  }
  const FactoredResponse& at_rest() const;
  std::shared_ptr<const FactoredResponse> tangent_at(const LargeState& state) const;
  MatrixXd displace_far(const MatrixXd& forces) const;
  Vectors forces_on_nodes(const System& system, const VectorXd& forces) const;
  VectorXd at_points(const System& system, const Vectors& free_um) const;

  const CurvedGel& gel_;
  substrate::Loads loads_;
  substrate::Observations observations_;
  mutable std::once_flag once_;
  mutable std::shared_ptr<const System> system_;
  mutable std::shared_ptr<const FactoredResponse> at_rest_;
};

class CurvedGel final : public substrate::Substrate {
 public:
  CurvedGel(const Gel& gel, const substrate::SubstrateParameters& parameters, int threads)
      : Substrate(parameters, can_of(parameters)),
        gel_(gel),
        height_(gel.surface ? std::make_shared<const surface::Height>(*gel.surface) : nullptr),
        shape_(shape_of(gel, height_)),
        threads_(threads) {
    if (height_) check_walls(*gel.surface, *height_);
  }

  substrate::LazyResponse response(const substrate::Loads& loads,
                                   const substrate::Observations& observations) const override {
    // refuses what is no load before anything is computed
    for (const Target& t : targets_of(loads, 1)) {
      for (const Vec2 corner : {t.low_um, t.high_um}) check_known(corner, "a load");
    }
    const std::vector<Vec3> points = points_in_space(observations);
    for (const Vec3& p : points) check_known({p.x, p.y}, "a point");
    if (std::holds_alternative<std::vector<Vec3>>(observations.points_um)) {
      for (const Vec3& p : points) check_inside(shape_, p);
    }
    return std::make_shared<const CurvedResponse>(*this, loads, observations);
  }

  double stated_error() const override {
    const std::lock_guard lock(mutex_);
    return error_;
  }
  Figures figures() const override {
    const std::lock_guard lock(mutex_);
    Figures all = figures_;
    all.insert(all.end(), newton_figures_.begin(), newton_figures_.end());
    return all;
  }
  std::vector<Effect> effects() const override {
    substrate::GelEffects effects = substrate::effects_of_model(parameters_, capabilities());
    if (height_) {
      effects.surface.is_on = true;
      effects.surface.why = "the surface is given";
    }
    return effects.list();
  }
  const Gel& gel() const { return gel_; }
  int threads() const { return threads_; }
  numerics::FactorOptions factor_options() const {
    return {.threads = threads_, .memory_limit_GB = allowed_GB(parameters_.memory_limit_GB)};
  }
  bool is_large() const { return parameters_.effects.large_strain == Switch::on; }

  /// Under forces on the free nodes.
  LargeSolution solve_large(const System& system, Vectors forces_nN) const {
    const Stopwatch watch;
    LargeSolution solution =
        solve_neo_hooke(gel_, system.space, {.at_nodes_nN = std::move(forces_nN)}, 1, factor_options());
    const std::lock_guard lock(mutex_);
    newton_figures_ = {{"substrate_load_steps", std::int64_t{solution.load_steps}},
                       {"substrate_newton_steps", std::int64_t{solution.most_iterations}},
                       {"substrate_newton_s", watch.seconds()}};
    return solution;
  }

  /// On a mesh whose estimated error is below the tolerance, as far as memory goes; the first one, where that is 0.
  /// @param keeps_factor  of small strains; else it is gone, with its memory, once the mesh is known
  std::unique_ptr<const System> system_for(const substrate::Loads& loads, const substrate::Observations& observations,
                                           Axes load_axes, Axes point_axes, bool keeps_factor) const {
    const Stopwatch watch;
    Fineness fineness = first_fineness();
    const double tolerance = parameters_.displacement_tolerance;
    const MatrixXd probes = probes_of(loads);
    const auto displaced = [&](const System& s) {
      return solve_between(*s.factor, s.loads, load_axes, probes, s.points, point_axes);
    };
    MatrixXd before;  // two factors at a time are too many: of the coarser mesh these are kept
    if (tolerance > 0) before = displaced(*make_system(fineness.coarser(), loads, observations));
    auto system = make_system(fineness, loads, observations, keeps_factor || tolerance > 0);
    double error = std::numeric_limits<double>::infinity();
    if (tolerance > 0) {
      MatrixXd now = displaced(*system);
      error = estimated_error(before, now);
      for (int level = 0; error > tolerance; ++level) {
        if (level == kMostHalvings) {
          throw NotSolved(Report{.reason = "the gel's displacement is still estimated to be off by " + brief(error) +
                                           " after " + std::to_string(kMostHalvings) +
                                           " refinements: ask for a larger displacement_tolerance"});
        }
        fineness = fineness.finer();
        system.reset();
        system = make_system(fineness, loads, observations);
        before = std::move(now);
        now = displaced(*system);
        error = estimated_error(before, now);
      }
    }
    note(*system, error, watch.seconds());
    if (!keeps_factor) system->factor.reset();
    return system;
  }

  substrate::VolumeField volume(const std::vector<substrate::Ellipse>& ellipses,
                                const std::vector<Vec2>& forces_nN) const override {
    check(ellipses);
    substrate::check_forces(ellipses, forces_nN);
    const substrate::Loads loads{ellipses};
    const auto system = make_system(first_fineness(), loads, {}, !is_large());
    Vectors forces(system->space.nodes().size(), Eigen::Vector3d::Zero());
    add_loads(system->loads, {0, 2}, substrate::column_of(forces_nN).data(),
              [&](int node, int axis) -> double& { return forces[node][axis]; });
    const bool with_stress = parameters_.stress;
    if (is_large()) {
      const LargeSolution solution = solve_large(*system, forces);
      return volume_field(system->space, solution.state.at_nodes_um,
                          with_stress ? large_stress(gel_, solution.state) : StressLaw{});
    }
    const Vectors u = system->space.spread(solve(*system->factor, forces));
    return volume_field(system->space, u, with_stress ? linear_stress(system->space, {gel_, {}}, u) : StressLaw{});
  }

 private:
  static constexpr int kMostHalvings = 4;

  /// Points lie at any depth: cells grow four times less with the distance than where the surface alone is asked.
  Fineness first_fineness() const { return {parameters_.elements_across_adhesion, parameters_.growth / 4}; }

  static substrate::Capabilities can_of(const substrate::SubstrateParameters& parameters) {
    substrate::Capabilities can = kCurvedCan;
    can.linear = parameters.effects.large_strain != Switch::on;
    return can;
  }

  static Shape shape_of(const Gel& gel, const std::shared_ptr<const surface::Height>& height) {
    if (!height) return flat(gel.thickness_um);
    return {[height](Vec2 at) { return (*height)(at); }, gel.thickness_um};
  }

  /// However small, an element below a wall is as slanted as the wall.
  /// @throws InvalidData by place
  static void check_walls(const HeightMap& map, const surface::Height& height) {
    const double steepest = std::sqrt(1 / (kLeastScaledJacobian * kLeastScaledJacobian) - 1);
    for (int row = 0; row < 2 * map.n_y - 1; ++row) {
      for (int column = 0; column < 2 * map.n_x - 1; ++column) {
        const Vec2 at = map.place_um(0.5 * column, 0.5 * row);
        const double slope = norm(height.slope(at));
        if (slope <= steepest) continue;
        const auto degrees = [](double tangent) { return brief(std::atan(tangent) * 180 / std::numbers::pi); };
        throw InvalidData("the gel's surface at (" + brief(at.x) + ", " + brief(at.y) + ") um",
                          "no wall steeper than " + degrees(steepest) + " degrees", "one of " + degrees(slope));
      }
    }
  }

  /// Beyond its map the surface is made up: smooth enough for the gel far away, and not for a load.
  /// @throws InvalidData
  void check_known(Vec2 at, const char* what) const {
    if (!height_ || height_->contains(at)) return;
    const Vec2 low = height_->low_um(), high = height_->high_um();
    throw InvalidData(std::string(what) + " at x, y = " + brief(at.x) + ", " + brief(at.y) + " um",
                      "a place where the gel's surface is known: x " + brief(low.x) + " to " + brief(high.x) + ", y " +
                          brief(low.y) + " to " + brief(high.y) + " um",
                      "one outside");
  }

  /// Tractions that a lattice resolves: waves eight of its faces long, in four directions, each along x, y and z in
  /// turn.
  static MatrixXd waves_on(const substrate::SurfaceMesh& mesh, int n_components) {
    constexpr int kDirections = 4, kFaces = 8;
    const auto& face = mesh.faces.front();
    const Vec2 diagonal = mesh.points_um[face[2]] - mesh.points_um[face[0]];
    const double wave_number = 2 * std::numbers::pi / (kFaces * std::min(std::abs(diagonal.x), std::abs(diagonal.y)));
    MatrixXd waves = MatrixXd::Zero(n_components * std::ssize(mesh.points_um), kDirections);
    for (int d = 0; d < kDirections; ++d) {
      const double angle = d * std::numbers::pi / kDirections;
      const Vec2 k = wave_number * Vec2{std::cos(angle), std::sin(angle)};
      for (Index i = 0; i < std::ssize(mesh.points_um); ++i)
        waves(n_components * i + d % n_components, d) = std::cos(dot(k, mesh.points_um[i]));
    }
    return waves;
  }

  /// What the mesh is chosen by: of separate patches random signs, always the same.
  static MatrixXd probes_of(const substrate::Loads& loads) {
    if (const auto* mesh = std::get_if<substrate::SurfaceMesh>(&loads.shapes); mesh && !mesh->faces.empty())
      return waves_on(*mesh, loads.n_components);
    constexpr int kProbes = 4;
    MatrixXd probes(loads.n_components * loads.size(), kProbes);
    std::uint32_t state = 1;
    for (Index k = 0; k < probes.size(); ++k) {
      state = 1664525u * state + 1013904223u;  // Numerical Recipes' quick generator: its high bits are random enough
      probes.data()[k] = state >> 31 ? 1 : -1;
    }
    return probes;
  }

  /// As `refined` has it: the finer solution's error is orthogonal to the difference, and falls by 2^(3/2).
  static double estimated_error(const MatrixXd& coarse, const MatrixXd& fine) {
    const double fall = std::pow(2, 1.5), size = fine.norm();
    return size == 0 ? 0 : (fine - coarse).norm() / (std::sqrt(fall * fall - 1) * size);
  }

  std::unique_ptr<System> make_system(const Fineness& fineness, const substrate::Loads& loads,
                                      const substrate::Observations& observations, bool is_factorised = true) const {
    const double limit_GB = allowed_GB(parameters_.memory_limit_GB);
    const auto most = static_cast<std::int64_t>(1e9 * limit_GB / 1e5);  // as `refined` counts
    const std::vector<Target> targets = targets_of(loads, fineness.across);
    std::vector<Vec2> places;
    for (const Target& t : targets) places.insert(places.end(), {t.low_um, t.high_um});
    for (const Vec3& p : substrate::points_in_space(observations)) places.push_back({p.x, p.y});
    const Extent scene = substrate::extent_of(places, {});
    const double margin = substrate::margin_um(gel_, parameters_);
    const double depth = mean_depth_um(scene);
    const double coarsest = depth / fineness.layers;
    substrate::check_size(scene, coarsest, most);
    const GridLines lines = {even_lines(scene.low_um.x, scene.high_um.x, margin, coarsest),
                             even_lines(scene.low_um.y, scene.high_um.y, margin, coarsest),
                             layers_um(depth, fineness.layers)};
    const auto is_too_large = [&](const Box& box) {
      const double side = std::max({box.size_um[0], box.size_um[1], box.size_um[2]});
      double nearest = std::numeric_limits<double>::infinity();
      for (const Target& target : targets) {
        const double away = distance_um(box, target);
        nearest = std::min(nearest, away);
        if (side > target.side_um * (1 + 1e-9) && side > fineness.growth * away) return true;
      }
      const double misfit = misfit_um(box) * (1 - box.low_um[2] / depth);  // what is pulled follows the surface less
      // smaller neighbours bring their nodes onto this box, and must not be crushed by that
      constexpr double kMostMoved = 0.2;
      if (misfit > kMostMoved * std::min({box.size_um[0], box.size_um[1], box.size_um[2]})) return true;
      return box.low_um[2] == 0 && misfit > fineness.misfit * (side + nearest);
    };
    auto system = std::make_unique<System>(Block(shape_, lines, is_too_large, Sides::free, most, threads_), loads,
                                           observations, threads_);
    if (is_factorised)
      system->factor = system->space.factorise(linear_stiffness_of({gel_, {}}, system->block.mesh()), factor_options());
    return system;
  }

  double mean_depth_um(const Extent& scene) const {
    constexpr int kSamples = 16;
    const Vec2 size = scene.high_um - scene.low_um;
    double sum = 0;
    for (int k = 0; k < kSamples * kSamples; ++k) {
      const Vec2 share = {(k % kSamples + 0.5) / kSamples, (k / kSamples + 0.5) / kSamples};
      sum += shape_.height_um(scene.low_um + Vec2{share.x * size.x, share.y * size.y});
    }
    return shape_.base_um - sum / (kSamples * kSamples);
  }

  static double distance_um(const Box& box, const Target& target) {
    const auto outside = [](double low, double size, double from, double to) {
      return std::max({0.0, low - to, from - low - size});
    };
    return std::hypot(outside(box.low_um[0], box.size_um[0], target.low_um.x, target.high_um.x),
                      outside(box.low_um[1], box.size_um[1], target.low_um.y, target.high_um.y), box.low_um[2]);
  }

  /// From the surface to the biquadratic one through nine points over the box, at most.
  double misfit_um(const Box& box) const {
    const auto height = [&](double x, double y) {
      return shape_.height_um({box.low_um[0] + x * box.size_um[0], box.low_um[1] + y * box.size_um[1]});
    };
    std::array<double, 9> at_nodes;
    for (int k = 0; k < 9; ++k) at_nodes[k] = height(0.5 * (k % 3), 0.5 * (k / 3));
    constexpr std::array kPlaces = {0.2, 0.8};
    double largest = 0;
    for (const double y : kPlaces) {
      for (const double x : kPlaces) {
        const auto along = shape_values(x), across = shape_values(y);
        double value = 0;
        for (int k = 0; k < 9; ++k) value += along[k % 3] * across[k / 3] * at_nodes[k];
        largest = std::max(largest, std::abs(value - height(x, y)));
      }
    }
    return largest;
  }

  void note(const System& system, double error, double total_s) const {
    const std::lock_guard lock(mutex_);
    error_ = std::isfinite(error) ? error : 0;
    figures_ = {{"substrate_model", "curved"},
                {"substrate_thickness_um", gel_.thickness_um},
                {"substrate_unknowns", std::int64_t{system.space.n_unknowns()}},
                {"substrate_elements", std::int64_t{system.block.mesh().n_cells()}},
                {"substrate_factor_GB", system.factor ? system.factor->factor_GB() : 0.0},
                {"substrate_total_s", total_s}};
    if (std::isfinite(error)) figures_.emplace_back("substrate_estimated_error", error);
    newton_figures_.clear();
  }

  Gel gel_;
  std::shared_ptr<const surface::Height> height_;  ///< null: flat
  Shape shape_;
  int threads_;
  mutable std::mutex mutex_;
  mutable double error_ = 0;
  mutable Figures figures_ = {{"substrate_model", "curved"}};  // of the last call
  mutable Figures newton_figures_;
};

const FactoredResponse& CurvedResponse::at_rest() const {
  std::call_once(once_, [&] {
    system_ = gel_.system_for(loads_, observations_, load_axes(), point_axes(), !gel_.is_large());
    at_rest_ = gel_.is_large()
                   ? tangent_at(state_at_rest(system_->space))
                   : std::make_shared<const FactoredResponse>(system_, system_->factor, load_axes(), point_axes());
  });
  return *at_rest_;
}

MatrixXd CurvedResponse::displace(const MatrixXd& forces) const {
  MBTFM_ASSERT(forces.rows() == cols());
  if (is_empty()) return MatrixXd::Zero(rows(), forces.cols());
  return gel_.is_large() ? displace_far(forces) : at_rest().displace(forces);
}

Vectors CurvedResponse::forces_on_nodes(const System& s, const VectorXd& forces) const {
  Vectors at_nodes(s.space.nodes().size(), Eigen::Vector3d::Zero());
  add_loads(s.loads, load_axes(), forces.data(), [&](int node, int axis) -> double& { return at_nodes[node][axis]; });
  return at_nodes;
}

VectorXd CurvedResponse::at_points(const System& s, const Vectors& free_um) const {
  VectorXd values = VectorXd::Zero(rows());
  add_samples(
      s.points, point_axes(), [&](int node, int axis) { return free_um[node][axis]; }, values.data());
  return values;
}

MatrixXd CurvedResponse::displace_far(const MatrixXd& forces) const {
  const auto made =
      gel_.system_for(loads_, observations_, load_axes(), point_axes(), false);  // Newton's method needs the memory
  const System& s = *made;
  MatrixXd answers(rows(), forces.cols());
  for (Index column = 0; column < forces.cols(); ++column) {
    const LargeSolution solution = gel_.solve_large(s, forces_on_nodes(s, forces.col(column)));
    answers.col(column) = at_points(s, s.space.of_free_nodes(solution.state.at_nodes_um));
  }
  return answers;
}

/// On a coarse mesh the linear elements differ from these, which project what is left of div u, too: the derivative at
/// rest is by the same elements as the others.
std::shared_ptr<const FactoredResponse> CurvedResponse::tangent_at(const LargeState& state) const {
  auto tangent = system_->space.factorise(large_stiffness_of(gel_.gel(), system_->space, state), gel_.factor_options());
  return std::make_shared<const FactoredResponse>(system_, std::move(tangent), load_axes(), point_axes());
}

substrate::Tangent CurvedResponse::about(const VectorXd& forces) const {
  MBTFM_ASSERT(forces.size() == cols());
  if (!gel_.is_large() || is_empty()) return Response::about(forces);
  at_rest();
  if (forces.isZero(0)) return {.displacement_um = VectorXd::Zero(rows()), .response = at_rest_};
  const System& s = *system_;
  const LargeSolution solution = gel_.solve_large(s, forces_on_nodes(s, forces));
  return {.displacement_um = at_points(s, s.space.of_free_nodes(solution.state.at_nodes_um)),
          .response = tangent_at(solution.state)};
}

substrate::SharedResponse CurvedResponse::kept() const { return substrate::dense_response(matrix(), gel_.threads()); }

}  // namespace

substrate::Model curved_gel() {
  return {.kind = substrate::ModelKind::curved, .can = kCurvedCan, .make = substrate::make_model<CurvedGel>};
}

}  // namespace mbtfm::elements
