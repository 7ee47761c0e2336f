/// Point forces at the adhesions (Schwarz et al., Biophys. J. 83 (2002) 1380) and tractions on elements that cover the
/// cell (Dembo & Wang, Biophys. J. 76 (1999) 2307), both with a Tikhonov penalty.
#include <cmath>

#include "mbtfm/inverse/rows.h"
#include "mbtfm/tractions/dense_problem.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/extent.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/memory.h"
#include "substrate/ellipse.h"
#include "substrate/greens/models.h"
#include "substrate/loads.h"
#include "substrate/response.h"

namespace mbtfm::tractions {

namespace {

/// A "point" is a disc smaller than any adhesion one sees: beads next to it feel a point, none on it infinity.
constexpr double kPointRadius_um = 0.1;

/// @throws InvalidData where they spread over no area
double density_per_um2(const DisplacementField& beads) {
  const double density = beads_per_um2(beads);
  if (!(density > 0)) throw InvalidData("displacement", "beads spread over an area", "all on one line");
  return density;
}

/// Forces or tractions with what is known of their errors.
struct Loads {
  VectorXd values;
  MatrixXd covariance;  ///< by the noise
  MatrixXd response;    ///< to a force of one on each adhesion
  VectorXd sigma{};     ///< by load: noise, and what the penalty takes of loads as large as evidence has them
  Vec2 at(std::size_t load) const {
    return {values[2 * static_cast<Index>(load)], values[2 * static_cast<Index>(load) + 1]};
  }
};

/// The loads that a method has, and the forces spread evenly over the adhesions which are taken for the truth.
struct Model {
  Compliance compliance;
  std::size_t n_loads = 0;
  Compliance truth;
  std::size_t n_adhesions = 0;
};

Compliance even_forces(const TractionInputs& inputs, const substrate::Substrate& gel) {
  return [&gel, ellipses = substrate::ellipses_of(inputs.adhesions)](const std::vector<Vec2>& at) {
    return gel.compliance_um_per_nN(at, ellipses);
  };
}

/// Choose lambda and solve. `length_at_unit_density_um` is lambda E for lambda = 1 in the problem's own unit and one
/// bead a um²: what the penalty would be over an area, ∫ |u|² + (lambda/E)² ∫ |t|², in the place of sums over beads and
/// loads.
Loads regularised(const TractionInputs& inputs, const TractionParameters& parameters, const Model& model,
                  double length_at_unit_density_um, Reconstruction& r) {
  const auto n = 2 * static_cast<Index>(model.n_loads), n_true = 2 * static_cast<Index>(model.n_adhesions);
  const DenseProblem problem(inputs.beads, model.compliance, n, model.truth, n_true);
  if (problem.spectrum().data_squared() == 0) {
    r.remark = "no bead has moved: there is no traction";
    return {VectorXd::Zero(n), MatrixXd::Zero(n, n), MatrixXd::Zero(n, n_true)};
  }
  const double length_um = length_at_unit_density_um / std::sqrt(density_per_um2(inputs.beads));
  r.scan = problem.scan();
  r.lambda = parameters.lambda_um_per_kPa ? *parameters.lambda_um_per_kPa * inputs.gel.youngs_modulus_kPa / length_um
                                          : chosen_lambda(*r.scan, parameters.lambda_by);
  r.length_um = *r.lambda * length_um;
  const VectorXd loads = problem.spectrum().solve(*r.lambda);
  r.relative_l2 = problem.spectrum().relative_l2(*r.lambda);
  const double prior_variance = r.scan->variance / std::pow(r.scan->by_evidence, 2);
  return {loads, problem.spectrum().covariance(*r.lambda, r.scan->variance), problem.response_to_truth(*r.lambda),
          problem.spectrum().error_variances(*r.lambda, r.scan->variance, prior_variance).cwiseSqrt()};
}

/// By patch, of loads whose traction is `kPa_per_load` each.
void add_point_errors(const Loads& loads, const std::vector<double>& kPa_per_load, Reconstruction& r) {
  if (loads.sigma.size() == 0) return;
  for (std::size_t i = 0; i < kPa_per_load.size(); ++i) {
    const auto at = 2 * static_cast<Index>(i);
    r.sigmas_kPa.push_back(kPa_per_load[i] * Vec2{loads.sigma[at], loads.sigma[at + 1]});
  }
}

/// Standard errors of the forces' magnitudes, which are `sums` (rows 2a, 2a+1 for adhesion a) of the loads: by the
/// noise, and by what penalty and model make of forces spread over their adhesions.
/// docs/theory/reconstructions.md (17).
void state_errors(const Loads& loads, const MatrixXd& sums, std::vector<AdhesionForce>& forces) {
  const MatrixXd covariance = numerics::congruence(sums, loads.covariance);
  const MatrixXd missed =
      numerics::small_product(sums, loads.response) - MatrixXd::Identity(sums.rows(), loads.response.cols());
  for (std::size_t a = 0; a < forces.size(); ++a) {
    const Eigen::RowVector2d e =
        inverse::direction_of(Eigen::Vector2d(forces[a].force_nN.x, forces[a].force_nN.y)).transpose();
    const auto row = 2 * static_cast<Index>(a);
    double variance = (e * covariance.block<2, 2>(row, row) * e.transpose()).value();
    for (std::size_t b = 0; b < forces.size(); ++b) {
      const Eigen::Vector2d force(forces[b].force_nN.x, forces[b].force_nN.y);
      const double share = (e * missed.block<2, 2>(row, 2 * static_cast<Index>(b)) * force).value();
      variance += share * share;
    }
    forces[a].sigma_nN = std::sqrt(variance);
  }
}

std::vector<Vec2> square_centres(const Polygon& outline, double side_um) {
  const auto [low, high] = extent_of(outline);
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
  const auto gel = greens::make_greens(inputs.gel, {.model = substrate::kind_of(parameters.gel_model)}, threads);
  const std::vector<substrate::Ellipse> ellipses = substrate::ellipses_of(inputs.adhesions);
  std::vector<substrate::Ellipse> points;
  double area = 0;
  for (const Adhesion& a : inputs.adhesions) {
    points.push_back({a.position_um, kPointRadius_um, kPointRadius_um, 0});
    area += a.area_um2 / static_cast<double>(inputs.adhesions.size());
  }
  Reconstruction r;
  r.lambda_unit = LambdaUnit::um_per_nN;
  // sum of F² over adhesions of area a approximates a times the integral of t²
  const Model model{.compliance = [&](const std::vector<Vec2>& at) { return gel->compliance_um_per_nN(at, points); },
                    .n_loads = points.size(),
                    .truth = even_forces(inputs, *gel),
                    .n_adhesions = points.size()};
  const Loads loads = regularised(inputs, parameters, model, inputs.gel.youngs_modulus_kPa * std::sqrt(area), r);
  r.forces = forces_with_errors(inputs.adhesions, loads.values, loads.covariance);
  std::vector<Vec2> forces;
  for (const AdhesionForce& f : r.forces) forces.push_back(f.force_nN);
  for (std::size_t a = 0; a < forces.size(); ++a) {
    const Adhesion& adhesion = inputs.adhesions[a];
    // a point yields without end: the work is that of the force spread over its adhesion, at its centre
    const std::vector<Vec2> u = gel->displacements_um({adhesion.position_um}, ellipses, forces);
    r.patches.push_back({adhesion.position_um, adhesion.area_um2, 1 / adhesion.area_um2 * forces[a], u.front()});
  }
  state_errors(loads, MatrixXd::Identity(loads.values.size(), loads.values.size()), r.forces);
  std::vector<double> per_area;
  for (const Adhesion& a : inputs.adhesions) per_area.push_back(1 / a.area_um2);
  add_point_errors(loads, per_area, r);
  return r;
}

Reconstruction reconstruct_elements(const TractionInputs& inputs, const TractionParameters& parameters, int threads) {
  if (inputs.outline_um.empty()) throw UsageError("bem: --outline is missing: it needs the area of the cell");
  const double n = std::abs(signed_area_um2(inputs.outline_um)) / (parameters.element_um * parameters.element_um);
  constexpr double kMatrices = 3;  // normal equations, eigenvectors, covariance: of two components each way
  numerics::expect_room_for({.what = "the grid of tractions",
                             .count = n,
                             .parts = "elements",
                             .bytes_each = kMatrices * 4 * n * sizeof(double),
                             .remedy = "choose a larger element_um"});
  const std::vector<Vec2> centres = square_centres(inputs.outline_um, parameters.element_um);
  if (centres.empty()) throw UsageError("bem: no element of element_um fits into the outline");
  const auto gel = greens::make_greens(inputs.gel, {.model = substrate::kind_of(parameters.gel_model)}, threads);
  std::vector<substrate::Square> squares;
  for (const Vec2 centre : centres) squares.push_back({centre, parameters.element_um});
  const auto compliance = [&](const std::vector<Vec2>& at) { return gel->response({squares}, {at})->matrix(); };
  const double area = parameters.element_um * parameters.element_um;
  Reconstruction r;
  r.lambda_unit = LambdaUnit::um_per_kPa;
  // a times the sum of t² over elements of area a is the integral of t²
  const Model model{.compliance = compliance,
                    .n_loads = centres.size(),
                    .truth = even_forces(inputs, *gel),
                    .n_adhesions = inputs.adhesions.size()};
  const Loads loads = regularised(inputs, parameters, model, inputs.gel.youngs_modulus_kPa / std::sqrt(area), r);
  const VectorXd u = compliance(centres) * loads.values;
  for (std::size_t j = 0; j < centres.size(); ++j) {
    const auto at = 2 * static_cast<Index>(j);
    r.patches.push_back({centres[j], area, loads.at(j), {u[at], u[at + 1]}});
  }
  r.forces = forces_by_adhesion(r.patches, inputs.adhesions, parameters.grow_um);
  const std::vector<int> owner = adhesion_of_patches(centres, inputs.adhesions, parameters.grow_um);
  MatrixXd sums = MatrixXd::Zero(2 * static_cast<Index>(r.forces.size()), loads.values.size());
  for (std::size_t i = 0; i < centres.size(); ++i) {
    if (owner[i] >= 0) sums.block<2, 2>(2 * owner[i], 2 * static_cast<Index>(i)) = area * Eigen::Matrix2d::Identity();
  }
  state_errors(loads, sums, r.forces);
  add_point_errors(loads, std::vector<double>(centres.size(), 1), r);
  r.figures = {{"n_elements", std::int64_t(centres.size())}};
  return r;
}

}  // namespace mbtfm::tractions
