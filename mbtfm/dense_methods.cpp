/// Point forces at the adhesions (Schwarz et al., Biophys. J. 83 (2002) 1380) and tractions on elements that cover the
/// cell (Dembo & Wang, Biophys. J. 76 (1999) 2307), both with a Tikhonov penalty.
#include <cmath>

#include "mbtfm/dense_problem.h"
#include "mbtfm/panel.h"
#include "mbtfm/traction.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/parallel.h"
#include "substrate/ellipse.h"

namespace mbtfm::inverse {

namespace {

using Eigen::Index;

/// A "point" is a disc smaller than any adhesion one sees: beads next to it feel a point, none on it infinity.
constexpr double kPointRadius_um = 0.1;

double beads_per_um2(const DisplacementField& beads) {
  Vec2 low = beads.front().position_um, high = low;
  for (const Bead& b : beads) {
    low = {std::min(low.x, b.position_um.x), std::min(low.y, b.position_um.y)};
    high = {std::max(high.x, b.position_um.x), std::max(high.y, b.position_um.y)};
  }
  const double area = (high.x - low.x) * (high.y - low.y);
  if (!(area > 0)) throw InvalidData("displacement", "beads spread over an area", "all on one line");
  return static_cast<double>(beads.size()) / area;
}

/// Choose lambda and solve. `length_um` is lambda E for lambda = 1 in the problem's own unit: what the penalty would be
/// over an area, ∫ |u|² + (lambda/E)² ∫ |t|², in the place of sums over beads and loads.
Eigen::VectorXd regularised(const DenseProblem& problem, const TractionParameters& parameters, double length_um,
                            double youngs_modulus_kPa, Reconstruction& r) {
  r.scan = problem.scan();
  r.lambda = parameters.lambda_um_per_kPa ? *parameters.lambda_um_per_kPa * youngs_modulus_kPa / length_um
                                          : chosen_lambda(*r.scan, parameters.lambda_by);
  r.length_um = *r.lambda * length_um;
  const Eigen::VectorXd loads = problem.solve(*r.lambda);
  r.relative_l2 = problem.relative_l2(loads);
  return loads;
}

/// Standard error of the magnitude of a force from the covariance of its components.
double magnitude_deviation(Vec2 force, const Eigen::Matrix2d& covariance) {
  const double length = norm(force);
  const Eigen::Vector2d e = length > 0 ? Eigen::Vector2d(force.x / length, force.y / length) : Eigen::Vector2d(1, 0);
  return std::sqrt(e.dot(covariance * e));
}

std::vector<Vec2> square_centres(const Polygon& outline, double side_um) {
  Vec2 low = outline.front(), high = low;
  for (const Vec2 p : outline) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y)};
  }
  const Vec2 middle = 0.5 * (low + high);
  const int n_x = static_cast<int>(std::ceil((high.x - low.x) / side_um));
  const int n_y = static_cast<int>(std::ceil((high.y - low.y) / side_um));
  std::vector<Vec2> centres;
  for (int j = 0; j < n_y; ++j) {
    for (int i = 0; i < n_x; ++i) {
      const Vec2 centre = middle + side_um * Vec2{i - 0.5 * (n_x - 1), j - 0.5 * (n_y - 1)};
      if (contains(outline, centre)) centres.push_back(centre);
    }
  }
  return centres;
}

}  // namespace

Reconstruction reconstruct_point_forces(const TractionInputs& inputs, const TractionParameters& parameters,
                                        int threads) {
  if (inputs.adhesions.empty()) throw UsageError("trpf: --adhesions is missing or holds none");
  const auto gel = substrate::make_greens(inputs.gel, {.model = parameters.gel_model}, threads);
  std::vector<substrate::Ellipse> points, ellipses;
  double area = 0;
  for (const Adhesion& a : inputs.adhesions) {
    points.push_back({a.position_um, kPointRadius_um, kPointRadius_um, 0});
    ellipses.push_back(substrate::ellipse_of(a));
    area += a.area_um2 / static_cast<double>(inputs.adhesions.size());
  }
  const auto n_loads = 2 * static_cast<Index>(points.size());
  const DenseProblem problem(
      inputs.beads, [&](const std::vector<Vec2>& at) { return gel->compliance_um_per_nN(at, points); }, n_loads);
  Reconstruction r;
  r.lambda_unit = "um_per_nN";
  Eigen::VectorXd loads = Eigen::VectorXd::Zero(n_loads);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n_loads, n_loads);
  if (problem.data_squared() == 0) {
    r.remark = "no bead has moved: there is no force";
  } else {
    // sum of F² over adhesions of area a stands for a times the integral of t²
    const double length_um = inputs.gel.youngs_modulus_kPa * std::sqrt(area / beads_per_um2(inputs.beads));
    loads = regularised(problem, parameters, length_um, inputs.gel.youngs_modulus_kPa, r);
    covariance = problem.covariance(*r.lambda, r.scan->variance);
  }
  std::vector<Vec2> forces;
  for (Index a = 0; a < n_loads; a += 2) forces.push_back({loads[a], loads[a + 1]});
  for (std::size_t a = 0; a < forces.size(); ++a) {
    const Adhesion& adhesion = inputs.adhesions[a];
    const auto at = 2 * static_cast<Index>(a);
    r.forces.push_back({.adhesion_id = adhesion.adhesion_id,
                        .force_nN = forces[a],
                        .sigma_nN = magnitude_deviation(forces[a], covariance.block<2, 2>(at, at)),
                        .connected = false,
                        .moment_nN_um = 0});
    // a point yields without end: the work is that of the force spread over its adhesion, at its centre
    const std::vector<Vec2> u = gel->displacements_um({adhesion.position_um}, ellipses, forces);
    r.patches.push_back({adhesion.position_um, adhesion.area_um2, 1 / adhesion.area_um2 * forces[a], u.front()});
  }
  return r;
}

Reconstruction reconstruct_elements(const TractionInputs& inputs, const TractionParameters& parameters, int threads) {
  if (inputs.outline_um.empty()) throw UsageError("bem: --outline is missing: it needs the area of the cell");
  const std::vector<Vec2> centres = square_centres(inputs.outline_um, parameters.element_um);
  if (centres.empty()) throw UsageError("bem: no element of element_um fits into the outline");
  check(inputs.gel);
  const substrate::Layer layer(inputs.gel);
  const bool is_layer = parameters.gel_model == "layer";
  const auto n_loads = 2 * static_cast<Index>(centres.size());
  const auto compliance = [&](const std::vector<Vec2>& at) {
    Eigen::MatrixXd G(2 * static_cast<Index>(at.size()), n_loads);
    parallel_for(static_cast<int>(centres.size()), threads, [&](int j) {
      for (std::size_t i = 0; i < at.size(); ++i) {
        const Vec2 offset = at[i] - centres[static_cast<std::size_t>(j)];
        const substrate::Sym2 g = is_layer ? square_compliance_um_per_kPa(layer, parameters.element_um, offset)
                                           : square_compliance_um_per_kPa(inputs.gel, parameters.element_um, offset);
        G.block<2, 2>(2 * static_cast<Index>(i), 2 * j) << g.xx, g.xy, g.xy, g.yy;
      }
    });
    return G;
  };
  const DenseProblem problem(inputs.beads, compliance, n_loads);
  const double area = parameters.element_um * parameters.element_um;
  Reconstruction r;
  r.lambda_unit = "um_per_kPa";
  Eigen::VectorXd loads = Eigen::VectorXd::Zero(n_loads);
  Eigen::MatrixXd covariance = Eigen::MatrixXd::Zero(n_loads, n_loads);
  if (problem.data_squared() == 0) {
    r.remark = "no bead has moved: there is no traction";
  } else {
    // sum of t² over elements of area a stands for the integral of t² over a
    const double length_um = inputs.gel.youngs_modulus_kPa / std::sqrt(area * beads_per_um2(inputs.beads));
    loads = regularised(problem, parameters, length_um, inputs.gel.youngs_modulus_kPa, r);
    covariance = area * area * problem.covariance(*r.lambda, r.scan->variance);
  }
  const Eigen::VectorXd u = compliance(centres) * loads;
  for (std::size_t j = 0; j < centres.size(); ++j) {
    const auto at = 2 * static_cast<Index>(j);
    r.patches.push_back({centres[j], area, {loads[at], loads[at + 1]}, {u[at], u[at + 1]}});
  }
  r.forces = forces_by_adhesion(r.patches, inputs.adhesions, parameters.grow_um);
  const std::vector<int> owner = adhesion_of_patches(centres, inputs.adhesions, parameters.grow_um);
  for (std::size_t a = 0; a < r.forces.size(); ++a) {
    Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
    for (std::size_t i = 0; i < centres.size(); ++i) {
      for (std::size_t j = 0; j < centres.size(); ++j) {
        if (owner[i] == static_cast<int>(a) && owner[j] == owner[i]) {
          sum += covariance.block<2, 2>(2 * static_cast<Index>(i), 2 * static_cast<Index>(j));
        }
      }
    }
    r.forces[a].sigma_nN = magnitude_deviation(r.forces[a].force_nN, sum);
  }
  r.figures = {{"n_elements", std::int64_t(centres.size())}};
  return r;
}

}  // namespace mbtfm::inverse
