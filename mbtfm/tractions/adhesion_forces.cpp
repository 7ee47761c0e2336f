/// The thesis' null model: each adhesion pulls with a force of its own, whatever the others do. Linear least squares.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "mbtfm/inverse/rows.h"
#include "mbtfm/inverse/spectrum.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/parallel.h"
#include "substrate/ellipse.h"
#include "substrate/greens/models.h"

namespace mbtfm::tractions {

namespace {

using substrate::Ellipse;

/// u = G F at the beads, weighted, and the normal equations of it.
struct Equations {
  std::vector<Vec2> positions_um;
  WeightedBeads beads;
  MatrixXd G{}, normal{};
  VectorXd adjoint{};
  MatrixXd response_to(const substrate::Substrate& gel, const std::vector<Ellipse>& ellipses) const {
    return beads.roots.asDiagonal() * gel.compliance_um_per_nN(positions_um, ellipses);
  }
};

/// @param values  of the normal matrix, without those that are rounding
void check_solvable(const Eigen::ArrayXd& values) {
  const auto n_lost = (values <= 0).count();
  if (n_lost == 0) return;
  throw NotSolved({.reason = std::to_string(n_lost) + " of " + std::to_string(values.size()) +
                             " force components are not felt by any bead or not resolved: adhesions that lie on each "
                             "other, or far from all beads"});
}

/// The force of ellipse a, were that ellipse another and the rest as they are.
Vec2 force_with(const substrate::Substrate& gel, const Equations& of, Index a, const Ellipse& other) {
  const MatrixXd columns = of.response_to(gel, {other});
  MatrixXd A = of.normal;
  VectorXd b = of.adjoint;
  A.middleCols<2>(2 * a) = numerics::small_transposed_product(of.G, columns);
  A.block<2, 2>(2 * a, 2 * a) = numerics::small_transposed_product(columns, columns);
  A.middleRows<2>(2 * a) = A.middleCols<2>(2 * a).transpose().eval();
  b.segment<2>(2 * a) = numerics::transposed_matvec(columns, of.beads.data);
  const VectorXd forces = numerics::solve_symmetric(A, b);
  return {forces[2 * a], forces[2 * a + 1]};
}

/// A force is stationary where its ellipse fits best, so derivatives would say little: finite errors do.
Sensitivity sensitivity(const substrate::Substrate& gel, const Equations& of, Vec2 force_nN, const Ellipse& ellipse,
                        Index a) {
  // errors of an ellipse as segmentations have them
  constexpr double kShift_um = 0.3, kSize = 0.2, kTurn_deg = 10;
  const Vec2 along{std::cos(ellipse.angle_rad), std::sin(ellipse.angle_rad)};
  const auto change_nN = [&](const Ellipse& other) { return norm(force_with(gel, of, a, other) - force_nN); };
  Ellipse shifted_along = ellipse, shifted_across = ellipse, grown = ellipse, turned = ellipse;
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
Vec2 mean_displacement_um(const substrate::Substrate& gel, const Ellipse& at, const std::vector<Ellipse>& ellipses,
                          const std::vector<Vec2>& forces_nN) {
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
  Equations all{points_of(inputs.beads), weighted(inputs.beads, static_cast<double>(inputs.beads.size()))};
  const VectorXd& u = all.beads.data;
  const MatrixXd& G = all.G = all.response_to(*gel, ellipses);
  all.normal = numerics::small_transposed_product(G, G);
  all.adjoint = numerics::transposed_matvec(G, u);
  const Spectrum spectrum(all.normal, all.adjoint, u.squaredNorm(), static_cast<double>(G.rows()));
  check_solvable(spectrum.values());
  const VectorXd forces = spectrum.solve(0), residual = numerics::minus_matvec(u, G, forces);

  Reconstruction r;
  const double left = residual.squaredNorm() / static_cast<double>(G.rows() - G.cols());
  // As for the tensions (7): the errors stated, or the larger ones that the misfit shows.
  const MatrixXd covariance = spectrum.covariance(0, std::max(left, all.beads.stated_variance.value_or(0)));
  r.forces = forces_with_errors(inputs.adhesions, forces, covariance);
  std::vector<Vec2> forces_nN;
  for (const AdhesionForce& f : r.forces) forces_nN.push_back(f.force_nN);
  r.sensitivities.resize(ellipses.size());
  const auto alone =
      greens::make_greens(inputs.gel, {.model = substrate::kind_of(parameters.gel_model)}, 1);  // one column a thread
  numerics::parallel_for(static_cast<int>(ellipses.size()), threads, [&](int a) {
    const auto i = static_cast<std::size_t>(a);
    r.sensitivities[i] = sensitivity(*alone, all, forces_nN[i], ellipses[i], a);
  });
  for (std::size_t a = 0; a < ellipses.size(); ++a) {
    const Adhesion& adhesion = inputs.adhesions[a];
    r.patches.push_back({.position_um = adhesion.position_um,
                         .area_um2 = adhesion.area_um2,
                         .traction_kPa = 1 / adhesion.area_um2 * forces_nN[a],
                         .displacement_um = mean_displacement_um(*gel, ellipses[a], ellipses, forces_nN)});
    const Eigen::Vector2d sigma = covariance.diagonal().segment<2>(2 * static_cast<Index>(a)).cwiseSqrt();
    r.sigmas_kPa.push_back(1 / adhesion.area_um2 * Vec2{sigma.x(), sigma.y()});
  }
  const double size = u.norm();
  if (size > 0) r.magnitudes = expected_magnitudes(forces_nN, covariance);
  r.relative_l2 = size > 0 ? residual.norm() / size : 0;
  if (size == 0) r.remark = "no bead has moved: there is no force";
  r.figures = {{all.beads.stated_variance ? "chi_squared_per_degree" : "residual_variance_um2",
                left / all.beads.stated_variance.value_or(1)}};
  return r;
}

}  // namespace mbtfm::tractions
