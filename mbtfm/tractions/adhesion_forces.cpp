/// The thesis' null model: each adhesion pulls with a force of its own, whatever the others do. Linear least squares.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "mbtfm/tractions/traction.h"
#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/parallel.h"
#include "substrate/ellipse.h"
#include "substrate/greens/models.h"

namespace mbtfm::tractions {

namespace {

using substrate::Ellipse;

/// u = G F at the beads with weights 1/sigma, or equal ones where not all beads state their error.
struct WeightedBeads {
  std::vector<Vec2> positions_um;
  VectorXd weight, displacement;  ///< displacement: times the weight
  bool states_errors = false;
};

WeightedBeads weighted(const DisplacementField& beads) {
  WeightedBeads w;
  w.states_errors = state_errors(beads);
  w.positions_um = points_of(beads);
  w.weight.resize(2 * static_cast<Index>(beads.size()));
  w.displacement.resize(w.weight.size());
  for (std::size_t i = 0; i < beads.size(); ++i) {
    const double weight = w.states_errors ? 1 / beads[i].sigma_um : 1;
    const Index row = 2 * static_cast<Index>(i);
    w.weight.segment<2>(row).setConstant(weight);
    w.displacement.segment<2>(row) << weight * beads[i].displacement_um.x, weight * beads[i].displacement_um.y;
  }
  return w;
}

MatrixXd weighted_compliance(const substrate::Substrate& gel, const WeightedBeads& beads,
                             const std::vector<substrate::Ellipse>& ellipses) {
  MatrixXd matrix = gel.compliance_um_per_nN(beads.positions_um, ellipses);
  for (Index column = 0; column < matrix.cols(); ++column) {
    matrix.col(column).array() *= beads.weight.array();
  }
  return matrix;
}

/// @param values  of the normal matrix
void check_solvable(const VectorXd& values) {
  constexpr double kRounding = 1e-13;  // of the normal matrix
  const auto n_lost = (values.array() <= kRounding * values.maxCoeff()).count();
  if (n_lost == 0) return;
  throw NotSolved({.reason = std::to_string(n_lost) + " of " + std::to_string(values.size()) +
                             " force components are not felt by any bead or not told apart: adhesions that lie on each "
                             "other, or far from all beads"});
}

/// The force of ellipse a, were that ellipse another and the rest as they are.
Vec2 force_with(const substrate::Substrate& gel, const WeightedBeads& beads, const MatrixXd& G, const MatrixXd& normal,
                const VectorXd& pulled, Index a, const substrate::Ellipse& other) {
  const MatrixXd columns = weighted_compliance(gel, beads, {other});
  MatrixXd A = normal;
  VectorXd b = pulled;
  A.middleCols<2>(2 * a) = numerics::small_transposed_product(G, columns);
  A.block<2, 2>(2 * a, 2 * a) = numerics::small_transposed_product(columns, columns);
  A.middleRows<2>(2 * a) = A.middleCols<2>(2 * a).transpose().eval();
  b.segment<2>(2 * a) = numerics::transposed_matvec(columns, beads.displacement);
  const VectorXd forces = numerics::solve_symmetric(A, b);
  return {forces[2 * a], forces[2 * a + 1]};
}

/// A force is stationary where its ellipse fits best, so derivatives would say little: finite errors do.
Sensitivity sensitivity(const substrate::Substrate& gel, const WeightedBeads& beads, const MatrixXd& G,
                        const MatrixXd& normal, const VectorXd& pulled, Vec2 force_nN,
                        const substrate::Ellipse& ellipse, Index a) {
  // errors of an ellipse as segmentations have them
  constexpr double kShift_um = 0.3, kSize = 0.2, kTurn_deg = 10;
  const Vec2 along{std::cos(ellipse.angle_rad), std::sin(ellipse.angle_rad)};
  const auto change_nN = [&](const substrate::Ellipse& other) {
    return norm(force_with(gel, beads, G, normal, pulled, a, other) - force_nN);
  };
  substrate::Ellipse shifted_along = ellipse, shifted_across = ellipse, grown = ellipse, turned = ellipse;
  shifted_along.centre_um += kShift_um * along;
  shifted_across.centre_um += kShift_um * Vec2{-along.y, along.x};
  grown.semi_major_um *= 1 + kSize;
  grown.semi_minor_um *= 1 + kSize;
  turned.angle_rad += kTurn_deg * std::numbers::pi / 180;
  return {.shift_along_nN = change_nN(shifted_along),
          .shift_across_nN = change_nN(shifted_across),
          .size_nN = change_nN(grown),
          .angle_nN = change_nN(turned)};
}

/// The model's mean displacement over an ellipse.
Vec2 mean_displacement_um(const substrate::Substrate& gel, const substrate::Ellipse& at,
                          const std::vector<substrate::Ellipse>& ellipses, const std::vector<Vec2>& forces_nN) {
  std::vector<Vec2> points;
  const std::vector<substrate::DiscPoint> rule = substrate::ellipse_rule(at, 5);
  for (const substrate::DiscPoint& p : rule) points.push_back(at.centre_um + p.position);
  const std::vector<Vec2> u = gel.displacements_um(points, ellipses, forces_nN);
  Vec2 mean;
  for (std::size_t i = 0; i < u.size(); ++i) mean += rule[i].weight * u[i];
  return mean;
}

}  // namespace

Reconstruction reconstruct_adhesion_forces(const TractionInputs& inputs, const TractionParameters& parameters,
                                           int threads) {
  if (inputs.adhesions.empty()) throw UsageError("adhesion-forces: --adhesions is missing or holds none");
  check(inputs.beads);
  if (inputs.beads.size() <= inputs.adhesions.size()) {
    throw InvalidData("displacement", "more beads than the " + std::to_string(inputs.adhesions.size()) + " adhesions",
                      std::to_string(inputs.beads.size()));
  }
  const auto gel = greens::make_greens(inputs.gel, {.model = substrate::kind_of(parameters.gel_model)}, threads);
  const std::vector<Ellipse> ellipses = substrate::ellipses_of(inputs.adhesions);
  const WeightedBeads beads = weighted(inputs.beads);
  const MatrixXd G = weighted_compliance(*gel, beads, ellipses);
  const MatrixXd normal_matrix = numerics::small_transposed_product(G, G);
  const auto [values, vectors] = numerics::symmetric_eigen(normal_matrix);
  check_solvable(values);
  const MatrixXd inverse = numerics::weighted_outer(vectors, values.cwiseInverse());
  const VectorXd pulled = numerics::transposed_matvec(G, beads.displacement);
  const VectorXd forces = numerics::matvec(inverse, pulled);
  const VectorXd residual = numerics::minus_matvec(beads.displacement, G, forces);

  Reconstruction r;
  const double chi_squared = residual.squaredNorm() / static_cast<double>(G.rows() - G.cols());
  // As for the tensions (7): the errors stated, or the larger ones that the misfit tells of.
  const double variance = beads.states_errors ? std::max(1.0, chi_squared) : chi_squared;
  const MatrixXd covariance = variance * inverse;
  std::vector<Vec2> forces_nN;
  for (std::size_t a = 0; a < ellipses.size(); ++a) {
    const auto at = 2 * static_cast<Index>(a);
    const Eigen::Vector2d f = forces.segment<2>(at);
    forces_nN.push_back({f.x(), f.y()});
    const Vec2 along = direction_of(forces_nN.back());
    const Eigen::Vector2d e(along.x, along.y);
    r.forces.push_back({.adhesion_id = inputs.adhesions[a].adhesion_id,
                        .force_nN = forces_nN.back(),
                        .sigma_nN = std::sqrt(e.dot(covariance.block<2, 2>(at, at) * e)),
                        .connected = false,
                        .moment_nN_um = 0});
  }
  r.sensitivities.resize(ellipses.size());
  const auto alone =
      greens::make_greens(inputs.gel, {.model = substrate::kind_of(parameters.gel_model)}, 1);  // one column a thread
  numerics::parallel_for(static_cast<int>(ellipses.size()), threads, [&](int a) {
    const auto i = static_cast<std::size_t>(a);
    r.sensitivities[i] = sensitivity(*alone, beads, G, normal_matrix, pulled, forces_nN[i], ellipses[i], a);
  });
  for (std::size_t a = 0; a < ellipses.size(); ++a) {
    const Adhesion& adhesion = inputs.adhesions[a];
    r.patches.push_back({.position_um = adhesion.position_um,
                         .area_um2 = adhesion.area_um2,
                         .traction_kPa = 1 / adhesion.area_um2 * forces_nN[a],
                         .displacement_um = mean_displacement_um(*gel, ellipses[a], ellipses, forces_nN)});
  }
  for (std::size_t a = 0; a < ellipses.size(); ++a) {
    const Eigen::Vector2d sigma = covariance.diagonal().segment<2>(2 * static_cast<Index>(a)).cwiseSqrt();
    r.sigmas_kPa.push_back(1 / inputs.adhesions[a].area_um2 * Vec2{sigma.x(), sigma.y()});
  }
  const double size = beads.displacement.norm();
  if (size > 0) r.magnitudes = expected_magnitudes(forces_nN, covariance);
  r.relative_l2 = size > 0 ? residual.norm() / size : 0;
  if (size == 0) r.remark = "no bead has moved: there is no force";
  r.figures = {{beads.states_errors ? "chi_squared_per_degree" : "residual_variance_um2", chi_squared}};
  return r;
}

}  // namespace mbtfm::tractions
