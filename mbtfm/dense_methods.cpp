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

/// Forces or tractions with their covariance by the noise.
struct Loads {
  Eigen::VectorXd values;
  Eigen::MatrixXd covariance;
  Vec2 at(std::size_t load) const {
    return {values[2 * static_cast<Index>(load)], values[2 * static_cast<Index>(load) + 1]};
  }
  Eigen::Matrix2d covariance_of(std::size_t one, std::size_t other) const {
    return covariance.block<2, 2>(2 * static_cast<Index>(one), 2 * static_cast<Index>(other));
  }
};

/// Choose lambda and solve. `length_at_unit_density_um` is lambda E for lambda = 1 in the problem's own unit and one
/// bead a um²: what the penalty would be over an area, ∫ |u|² + (lambda/E)² ∫ |t|², in the place of sums over beads and
/// loads.
Loads regularised(const TractionInputs& inputs, const TractionParameters& parameters, const Compliance& compliance,
                  std::size_t n_loads, double length_at_unit_density_um, Reconstruction& r) {
  const auto n = 2 * static_cast<Index>(n_loads);
  const DenseProblem problem(inputs.beads, compliance, n);
  if (problem.data_squared() == 0) {
    r.remark = "no bead has moved: there is no traction";
    return {Eigen::VectorXd::Zero(n), Eigen::MatrixXd::Zero(n, n)};
  }
  const double length_um = length_at_unit_density_um / std::sqrt(beads_per_um2(inputs.beads));
  r.scan = problem.scan();
  r.lambda = parameters.lambda_um_per_kPa ? *parameters.lambda_um_per_kPa * inputs.gel.youngs_modulus_kPa / length_um
                                          : chosen_lambda(*r.scan, parameters.lambda_by);
  r.length_um = *r.lambda * length_um;
  const Eigen::VectorXd loads = problem.solve(*r.lambda);
  r.relative_l2 = problem.relative_l2(loads);
  return {loads, problem.covariance(*r.lambda, r.scan->variance)};
}

/// Standard error of the magnitude of a force from the covariance of its components.
double magnitude_deviation(Vec2 force, const Eigen::Matrix2d& covariance) {
  const Vec2 along = direction_of(force);
  const Eigen::Vector2d e(along.x, along.y);
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
  Reconstruction r;
  r.lambda_unit = "um_per_nN";
  // sum of F² over adhesions of area a stands for a times the integral of t²
  const Loads loads = regularised(
      inputs, parameters, [&](const std::vector<Vec2>& at) { return gel->compliance_um_per_nN(at, points); },
      points.size(), inputs.gel.youngs_modulus_kPa * std::sqrt(area), r);
  std::vector<Vec2> forces;
  for (std::size_t a = 0; a < points.size(); ++a) forces.push_back(loads.at(a));
  for (std::size_t a = 0; a < forces.size(); ++a) {
    const Adhesion& adhesion = inputs.adhesions[a];
    r.forces.push_back({.adhesion_id = adhesion.adhesion_id,
                        .force_nN = forces[a],
                        .sigma_nN = magnitude_deviation(forces[a], loads.covariance_of(a, a)),
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
  const auto compliance = [&](const std::vector<Vec2>& at) {
    Eigen::MatrixXd G(2 * at.size(), 2 * centres.size());
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
  const double area = parameters.element_um * parameters.element_um;
  Reconstruction r;
  r.lambda_unit = "um_per_kPa";
  // sum of t² over elements of area a stands for the integral of t² over a
  const Loads loads =
      regularised(inputs, parameters, compliance, centres.size(), inputs.gel.youngs_modulus_kPa / std::sqrt(area), r);
  const Eigen::VectorXd u = compliance(centres) * loads.values;
  for (std::size_t j = 0; j < centres.size(); ++j) {
    const auto at = 2 * static_cast<Index>(j);
    r.patches.push_back({centres[j], area, loads.at(j), {u[at], u[at + 1]}});
  }
  r.forces = forces_by_adhesion(r.patches, inputs.adhesions, parameters.grow_um);
  const std::vector<int> owner = adhesion_of_patches(centres, inputs.adhesions, parameters.grow_um);
  for (std::size_t a = 0; a < r.forces.size(); ++a) {
    Eigen::Matrix2d sum = Eigen::Matrix2d::Zero();
    for (std::size_t i = 0; i < centres.size(); ++i) {
      for (std::size_t j = 0; j < centres.size(); ++j) {
        if (owner[i] == static_cast<int>(a) && owner[j] == owner[i]) sum += loads.covariance_of(i, j);
      }
    }
    r.forces[a].sigma_nN = area * magnitude_deviation(r.forces[a].force_nN, sum);
  }
  r.figures = {{"n_elements", std::int64_t(centres.size())}};
  return r;
}

}  // namespace mbtfm::inverse
