/// Locally refined finite elements: no closed form anywhere, so what the others are checked against, at a price.
#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <numbers>
#include <numeric>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/report.h"
#include "pipeline/contract/stopwatch.h"
#include "substrate/elements/ellipse_load.h"
#include "substrate/elements/linear.h"
#include "substrate/elements/models.h"
#include "substrate/elements/surface_loads.h"
#include "substrate/elements/volume.h"
#include "substrate/loads.h"
#include "substrate/response.h"
#include "substrate/scene.h"

namespace mbtfm::elements {
namespace {

const double kFall = std::pow(2, 1.5);  // of the error at a load's rim when the elements there halve
constexpr double kAim = 0.9;  // of the tolerance: a second try costs more than what is spared by just reaching it
constexpr int kMostRefinements = 8;  // of refinement: 2^8 times finer than asked for no memory holds

/// Columns of the matrix, those of neighbouring ellipses side by side: along a Z-shaped (Morton) curve of 1024 x 1024.
std::vector<int> columns_by_place(const std::vector<substrate::Ellipse>& ellipses) {
  const Extent extent = substrate::extent_of({}, ellipses);
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

struct Refinement {
  double across = 1.4;        ///< square root of an ellipse's area over the largest side of an element on it
  int fewest_elements = 4;    ///< that touch an ellipse: the thesis' rule
  double growth = 4;          ///< of a side over its distance to the nearest ellipse, at most
  std::vector<int> halvings;  ///< by ellipse: of the side that follows; below 0: doublings
};

// of an element's sides: stiffness and ordering take it, and steps of the modulus near the surface ask for it
constexpr double kMostFlat = 4;

/// From the surface to the base, with a line at each step of the modulus.
std::vector<double> depths_of(const substrate::Material& material, double side_um) {
  std::vector<double> ends = substrate::steps_um(material);
  ends.push_back(material.gel.thickness_um);
  std::vector<double> depths = {0};
  for (const double end : ends) {
    const double begin = depths.back();
    const int n = std::max(1, static_cast<int>(std::lround((end - begin) / side_um)));
    for (int k = 1; k <= n; ++k) depths.push_back(k == n ? end : begin + (end - begin) * k / n);
  }
  return depths;
}

/// Sides of the coarsest elements along the surface: the gel's thickness, or less over thin layers.
double coarsest_side_um(const substrate::Material& material) {
  double side = material.gel.thickness_um;
  double before = 0;
  for (const double step : substrate::steps_um(material)) {
    side = std::min(side, kMostFlat * (step - before));
    before = step;
  }
  return std::min(side, kMostFlat * (material.gel.thickness_um - before));
}

/// Elements of a uniform grid that an ellipse touches.
int n_touched(const substrate::Ellipse& ellipse, Vec2 origin, double side) {
  const Vec2 half = substrate::half_extent_um(ellipse);
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
struct CoveredEllipse {
  double side_um, radius_um;
  std::vector<Vec2> centres_um;
};

CoveredEllipse covered(const substrate::Ellipse& ellipse, const GridLines& lines, const Refinement& fineness,
                       int halvings) {
  const double wanted = std::sqrt(std::numbers::pi * ellipse.semi_major_um * ellipse.semi_minor_um) / fineness.across;
  double side = std::max(lines.x_um[1] - lines.x_um[0], lines.y_um[1] - lines.y_um[0]);
  const Vec2 origin = {lines.x_um.front(), lines.y_um.front()};
  while (side > wanted || n_touched(ellipse, origin, side) < fineness.fewest_elements) side /= 2;
  side = std::ldexp(side, -halvings);

  const double b = ellipse.semi_minor_um;
  const double reach = std::max(0.0, ellipse.semi_major_um - b);
  const int n = static_cast<int>(std::ceil(reach / b));
  const Vec2 along = {std::cos(ellipse.angle_rad), std::sin(ellipse.angle_rad)};
  CoveredEllipse target{.side_um = side, .radius_um = b, .centres_um = {}};
  for (int k = -n; k <= n; ++k) target.centres_um.push_back(ellipse.centre_um + (n == 0 ? 0 : reach * k / n) * along);
  return target;
}

double distance(const Box& box, Vec2 point) {
  const auto outside = [](double low, double size, double x) { return std::max({0.0, low - x, x - low - size}); };
  const double dx = outside(box.low_um[0], box.size_um[0], point.x);
  const double dy = outside(box.low_um[1], box.size_um[1], point.y);
  return std::sqrt(dx * dx + dy * dy + box.low_um[2] * box.low_um[2]);
}

/// @throws NotSolved where it would have more than `most_cells`
Block refined_block(const substrate::Material& material, const Extent& scene,
                    const std::vector<substrate::Ellipse>& ellipses, const Refinement& fineness, double margin_um,
                    std::int64_t most_cells, int threads) {
  const double coarsest = coarsest_side_um(material);
  substrate::check_size(scene, coarsest, most_cells);
  // boxes that are nearly cubes; flatter over thin layers
  const GridLines lines = {even_lines(scene.low_um.x, scene.high_um.x, margin_um, coarsest),
                           even_lines(scene.low_um.y, scene.high_um.y, margin_um, coarsest),
                           depths_of(material, coarsest)};
  std::vector<CoveredEllipse> targets;
  for (std::size_t j = 0; j < ellipses.size(); ++j) {
    targets.push_back(covered(ellipses[j], lines, fineness, fineness.halvings[j]));
  }
  const auto is_too_large = [&](const Box& box) {
    const double side = std::max(box.size_um[0], box.size_um[1]);
    for (const CoveredEllipse& target : targets) {
      // the side grows with the distance: the field's own scale
      if (side <= target.side_um * (1 + 1e-9)) continue;
      for (const Vec2 centre : target.centres_um) {
        if (side > fineness.growth * (distance(box, centre) - target.radius_um)) return true;
      }
    }
    return false;
  };
  return {flat(material.gel.thickness_um), lines, is_too_large, Sides::free, most_cells, threads};
}

class Refined final : public substrate::Substrate {
 public:
  Refined(const Gel& gel, const substrate::SubstrateParameters& parameters, int threads)
      : Substrate(parameters, kRefinedCan),
        material_{gel, substrate::profile_of(parameters.modulus_profile)},
        threads_(threads) {}

  substrate::LazyResponse response(const substrate::Loads& loads,
                                   const substrate::Observations& observations) const override {
    const std::vector<Vec2> points_um = surface_points_of(observations);
    const std::vector<substrate::Ellipse> ellipses = ellipses_of(loads);
    const substrate::Components components = observations.components;
    // all axes for one, too: the error is a share of the whole displacement, and this part vanishes with 1 - 2 nu
    const Index n_axes = components == substrate::Components::along ? 2 : 3, n_forces = 2 * loads.size();
    const Index n_rows = observations.n_components() * observations.size();
    const auto asked = [=](const MatrixXd& field) -> MatrixXd {
      if (components != substrate::Components::normal) return field;
      return field(Eigen::seq(2, Eigen::last, 3), Eigen::all);
    };
    return substrate::lazy_response(
        {.rows = n_rows,
         .cols = n_forces,
         .matrix =
             [=, this] {
               return asked(solve({points_um, ellipses, MatrixXd::Identity(n_forces, n_forces), n_axes}));
             },
         .displace =
             [=, this](const MatrixXd& forces_nN) {
               MatrixXd field(n_rows, forces_nN.cols());
               for (Index column = 0; column < field.cols(); ++column)
                 field.col(column) = asked(solve({points_um, ellipses, forces_nN.col(column), n_axes}));
               return field;
             }});
  }

  double stated_error() const override {
    const std::lock_guard lock(mutex_);
    const auto estimated = std::find_if(figures_.begin(), figures_.end(),
                                        [](const auto& figure) { return figure.first == "substrate_estimated_error"; });
    if (estimated != figures_.end()) return std::get<double>(estimated->second);
    // notes/accuracy.md: 2.3 % with 1.4 elements across, 1.3 % with 2; falling as their number to the power 1.6
    return 0.023 * std::pow(1.4 / parameters_.elements_across_adhesion, 1.6);
  }

  /// On the first mesh: pictures need no more.
  substrate::VolumeField volume(const std::vector<substrate::Ellipse>& ellipses,
                                const std::vector<Vec2>& forces_nN) const override {
    check(ellipses);
    substrate::check_forces(ellipses, forces_nN);
    const auto system = system_for(first_fineness(ellipses.size()), {}, ellipses);
    Vectors forces(system->space.nodes().size(), Eigen::Vector3d::Zero());
    add_loads(system->loads, {0, 2}, substrate::column_of(forces_nN).data(),
              [&](int node, int axis) -> double& { return forces[node][axis]; });
    const Vectors u = system->space.spread(elements::solve(*system->factor, forces));
    return volume_field(system->space, u, parameters_.stress ? linear_stress(system->space, material_, u) : StressLaw{},
                        Gradients::mean);
  }

  Figures figures() const override {
    const std::lock_guard lock(mutex_);
    return figures_;
  }

 private:
  /// Columns wanted at points: the forces of each, and along how many axes the points are asked.
  struct Request {
    const std::vector<Vec2>& points_um;
    const std::vector<substrate::Ellipse>& ellipses;
    MatrixXd forces_nN;
    Index n_axes;
  };

  /// One mesh, or finer and finer ones until the estimated error is below the tolerance.
  MatrixXd solve(const Request& request) const {
    substrate::check_points(request.points_um);
    check(request.ellipses);
    const Index n_rows = request.n_axes * std::ssize(request.points_um);
    if (n_rows == 0 || request.ellipses.empty()) return MatrixXd::Zero(n_rows, request.forces_nN.cols());
    const Stopwatch watch;
    Refinement fineness = first_fineness(request.ellipses.size());
    MatrixXd columns;
    std::vector<double> errors;
    if (parameters_.displacement_tolerance == 0) {
      columns = solve_on(fineness, request);
    } else {
      for (int& halvings : fineness.halvings) --halvings;
      fineness.growth *= far_step();
      columns = solve_on(fineness, request);
      errors = refine_until_right(fineness, request, columns);
    }
    note_errors(errors, watch.seconds());
    return columns;
  }

  Refinement first_fineness(std::size_t n_ellipses) const {
    return {.across = parameters_.elements_across_adhesion,
            .growth = parameters_.growth,
            .halvings = std::vector<int>(n_ellipses, 0)};
  }

  /// Far away the error falls as the side cubed, near the rims as its power 3/2: there the side may shrink less.
  double far_step() const { return std::sqrt(2); }

  /// Halve the elements on the adhesions whose columns are worst, those far away by as much as they matter.
  /// @return the estimated error of each adhesion's columns
  std::vector<double> refine_until_right(Refinement& fineness, const Request& request, MatrixXd& columns) const {
    std::vector<double> errors(request.ellipses.size(), std::numeric_limits<double>::infinity());
    for (int level = 0; level < kMostRefinements; ++level) {
      const std::vector<std::size_t> finer_ones = worst(errors);
      for (const std::size_t j : finer_ones) ++fineness.halvings[j];
      fineness.growth /= far_step();
      MatrixXd finer = solve_finer(fineness, request, errors);
      for (const std::size_t j : finer_ones) {
        errors[j] = estimated_error(columns, finer, static_cast<Index>(j));
      }
      columns.swap(finer);
      if (mean(errors) <= parameters_.displacement_tolerance) return errors;
    }
    throw NotSolved(Report{.iterations = kMostRefinements,
                           .last_change = mean(errors),
                           .reason = "the substrate's error is still estimated as " + brief(mean(errors)) + " after " +
                                     std::to_string(kMostRefinements) +
                                     " refinements: ask for a larger displacement_tolerance"});
  }

  /// As many of the largest errors as must fall by q = 2^(3/2) for the mean to reach the tolerance; all where none is
  /// known yet.
  std::vector<std::size_t> worst(const std::vector<double>& errors) const {
    std::vector<std::size_t> order(errors.size());
    std::iota(order.begin(), order.end(), 0);
    if (std::isinf(errors[0])) return order;
    std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return errors[a] > errors[b]; });
    double excess = (mean(errors) - kAim * parameters_.displacement_tolerance) * static_cast<double>(errors.size());
    std::size_t n = 0;
    while (n < order.size() && excess > 0) excess -= (1 - 1 / kFall) * errors[order[n++]];
    order.resize(n);
    return order;
  }

  MatrixXd solve_finer(const Refinement& fineness, const Request& request, const std::vector<double>& errors) const {
    try {
      return solve_on(fineness, request);
    } catch (NotSolved& error) {
      if (std::isfinite(mean(errors))) {
        error.report->reason += "; the mesh before it has an estimated error of " + brief(mean(errors)) +
                                " (substrate.displacement_tolerance is " + brief(parameters_.displacement_tolerance) +
                                ")";
      }
      throw;
    }
  }

  /// From two meshes of which the finer has half the side. The error falls by q = 2^(3/2), and the finer solution's
  /// error is orthogonal in energy to the difference (the meshes are nested), so that about
  /// |difference|² = (q² - 1) |error of the finer|².
  static double estimated_error(const MatrixXd& coarse, const MatrixXd& fine, Index ellipse) {
    const bool is_matrix = fine.cols() > 1;
    const Index first = is_matrix ? 2 * ellipse : 0, n = is_matrix ? 2 : 1;
    const double size = fine.middleCols(first, n).norm();
    return size == 0 ? 0 : (fine - coarse).middleCols(first, n).norm() / (std::sqrt(kFall * kFall - 1) * size);
  }

  static double mean(const std::vector<double>& values) {
    return std::accumulate(values.begin(), values.end(), 0.0) / static_cast<double>(values.size());
  }

  MatrixXd solve_on(const Refinement& fineness, const Request& request) const {
    const Stopwatch watch;
    const auto system = system_for(fineness, request.points_um, request.ellipses);
    const double setup_s = watch.seconds();
    const bool is_one = request.forces_nN.cols() == 1;
    MatrixXd columns =
        solve_between(*system->factor, system->loads, {0, 2}, request.forces_nN, system->points, {0, request.n_axes},
                      is_one ? std::vector<int>() : columns_by_place(request.ellipses));
    note(*system, request.ellipses, setup_s);
    return columns;
  }

  std::unique_ptr<const System> system_for(const Refinement& fineness, const std::vector<Vec2>& points_um,
                                           const std::vector<substrate::Ellipse>& ellipses) const {
    // of an element: too few for any mesh (measured: 250 kB); the factor is weighed exactly
    constexpr double kBytes = 1e5;
    const auto most = static_cast<std::int64_t>(1e9 * allowed_GB(parameters_.memory_limit_GB) / kBytes);
    auto system = std::make_unique<System>(
        refined_block(material_, substrate::extent_of(points_um, ellipses), ellipses, fineness,
                      substrate::margin_um(material_.gel, parameters_), most, threads_),
        substrate::Loads{.shapes = ellipses}, substrate::Observations{.points_um = points_um}, threads_);
    system->factor = system->space.factorise(
        box_stiffness_of(material_, system->block.boxes()),
        {.threads = threads_,
         .memory_limit_GB = allowed_GB(parameters_.memory_limit_GB),
         .precision = is_single() ? numerics::Precision::single_ : numerics::Precision::double_});
    return system;
  }

  /// Rounding to single precision changes a column by 1 % at nu = 0.4999 (measured, 250 000 unknowns) and in proportion
  /// to lambda / mu; at 0.495 the error is the same to 0.001 points as in double precision.
  bool is_single() const {
    constexpr double kMostForSingle = 0.495;
    if (parameters_.precision) return parameters_.precision == numerics::Precision::single_;
    return material_.gel.poisson_ratio <= kMostForSingle;
  }

  void note(const System& system, const std::vector<substrate::Ellipse>& ellipses, double setup_s) const {
    const BlockMesh& boxes = system.block.boxes();
    std::size_t fewest = boxes.cells.size();
    for (const substrate::Ellipse& e : ellipses) fewest = std::min(fewest, touched_cells(system.block, e).size());
    const GridLines& lines = boxes.lines;
    const std::lock_guard lock(mutex_);
    figures_ = {{"substrate_model", "refined"},
                {"substrate_element", "q2-p1disc"},
                {"substrate_precision", std::string(is_single() ? "single" : "double")},
                {"substrate_thickness_um", material_.gel.thickness_um},
                {"substrate_unknowns", std::int64_t{system.space.n_unknowns()}},
                {"substrate_elements", static_cast<std::int64_t>(boxes.cells.size())},
                {"substrate_fewest_elements_of_an_adhesion", static_cast<std::int64_t>(fewest)},
                {"substrate_block_x_um", lines.x_um.back() - lines.x_um.front()},
                {"substrate_block_y_um", lines.y_um.back() - lines.y_um.front()},
                {"substrate_factor_GB", system.factor->factor_GB()},
                {"substrate_setup_s", setup_s}};
  }

  void note_errors(const std::vector<double>& errors, double total_s) const {
    const std::lock_guard lock(mutex_);
    if (!errors.empty()) figures_.emplace_back("substrate_estimated_error", mean(errors));
    figures_.emplace_back("substrate_total_s", total_s);
  }

  substrate::Material material_;
  int threads_;
  mutable std::mutex mutex_;
  mutable Figures figures_ = {{"substrate_model", "refined"}};  // of the last call
};

}  // namespace

substrate::Model refined() {
  return {.kind = substrate::ModelKind::refined, .can = kRefinedCan, .make = substrate::make_model<Refined>};
}

}  // namespace mbtfm::elements
