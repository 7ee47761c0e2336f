#include "samples/plan/known_cell.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "mbtfm/fit/ready_cell.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tensions/intervals.h"
#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/parallel.h"
#include "samples/experiment/experiment.h"
#include "substrate/choice/factory.h"
#include "substrate/loads.h"

namespace mbtfm::plan {

using namespace tensions;

namespace {

/// The forces of the cell's own network, which no fit knows.
experiment::Experiment own_network(const Scene& scene, int threads) {
  drawing::ScenarioParameters p = scene.experiment;
  p.beads = 1;  // they come later
  p.beads_per_um2.reset();
  return experiment::simulate(scene.cell, p, threads);
}

/// Of the network on the mesh of a fit, and of each fibre.
Eigen::VectorXd tensions_by_label(const Scene& scene, const std::vector<int>& fibre_ids) {
  Eigen::VectorXd tensions_nN(static_cast<Eigen::Index>(fibre_ids.size()));
  tensions_nN[0] = scene.experiment.tension.surface_tension_nN_per_um * scene.fit.network.edge_length_um /
                   std::sqrt(3.0);  // surface tension of a triangular lattice of cables: sqrt(3) t / edge
  const std::vector<Fibre>& fibres = scene.cell.cell.fibres;
  for (std::size_t i = 1; i < fibre_ids.size(); ++i) {
    const auto fibre = std::ranges::find(fibres, fibre_ids[i], &Fibre::fibre_id);
    MBTFM_ASSERT(fibre != fibres.end());
    tensions_nN[static_cast<Eigen::Index>(i)] = scene.cell.tensions_nN[fibre - fibres.begin()];
  }
  return tensions_nN;
}

/// Derivatives alone are asked of a problem that has no data.
ReducedData no_data(std::size_t n_adhesions) {
  const auto n = 2 * static_cast<Eigen::Index>(n_adhesions);
  ReducedData data;
  data.compliance = std::make_shared<const Eigen::MatrixXd>(Eigen::MatrixXd::Zero(n, n));
  data.target = Eigen::VectorXd::Zero(n);
  return data;
}

OtherParts other_parts(const ErrorParts& p) {
  ErrorParts rest = p;
  rest.beads = rest.segmentation = 0;
  rest.mesh.reset();
  return {.mesh_nN = p.mesh.value_or(0), .segmentation_nN = p.segmentation, .other_nN = total(rest)};
}

OtherParts scaled(const OtherParts& p, double factor) {
  return {factor * p.mesh_nN, factor * p.segmentation_nN, factor * p.other_nN};
}

}  // namespace

Eigen::VectorXd column_of(const std::vector<AdhesionForce>& forces) {
  Eigen::VectorXd column(2 * static_cast<Eigen::Index>(forces.size()));
  for (std::size_t a = 0; a < forces.size(); ++a)
    column.segment<2>(2 * static_cast<Eigen::Index>(a)) << forces[a].force_nN.x, forces[a].force_nN.y;
  return column;
}

KnownCell known_cell(const Scene& scene, const Work& work) {
  work.tell(0.02, "the cell's own network");
  const experiment::Experiment own = own_network(scene, work.threads);
  KnownCell cell{.adhesion_ids = adhesion_ids_of(own.cell),
                 .ellipses = substrate::ellipses_of(own.cell.adhesions),
                 .networks = {},
                 .fibre_ids = {},
                 .tensions_nN = {},
                 .forces_nN = column_of(own.forces),
                 .derivatives = {}};
  work.tell(0.1, "networks of a fit");
  cell.networks = fit::span_ensemble(own.cell, scene.fit, work.threads);
  cell.fibre_ids = cell.networks.front().fibre_ids();
  cell.tensions_nN = tensions_by_label(scene, cell.fibre_ids);
  cell.derivatives.resize(cell.networks.size());
  const ReducedData none = no_data(cell.adhesion_ids.size());
  numerics::parallel_for(static_cast<int>(cell.networks.size()), work.threads, [&](int m) {
    const auto i = static_cast<std::size_t>(m);
    const TensionProblem problem(cell.networks[i], none, cell.adhesion_ids);
    cell.derivatives[i] = problem.force_derivatives(problem.evaluate(cell.tensions_nN));
  });
  return cell;
}

DisplacementField exact_beads(const std::vector<Vec2>& places_um, const substrate::Response& response,
                              const Eigen::VectorXd& forces_nN, double sigma_um) {
  const Eigen::VectorXd u_um = response.displace(forces_nN);
  DisplacementField beads;
  for (std::size_t i = 0; i < places_um.size(); ++i) {
    const auto row = 2 * static_cast<Eigen::Index>(i);
    beads.push_back(
        {.position_um = places_um[i], .displacement_um = {u_um[row], u_um[row + 1]}, .sigma_um = sigma_um, .flag = {}});
  }
  return beads;
}

ModelErrors model_errors(const Scene& scene, const KnownCell& cell, const DisplacementField& beads,
                         substrate::SharedResponse response, const Work& work) {
  LinearData data = reduce(beads, std::move(response), {}, work.threads,
                           allows_common_motion(scene.fit.effects) ? affine_motions(beads) : Eigen::MatrixXd());
  FitParameters parameters = scene.fit.fit;
  parameters.loss = Loss::squares;
  const TensionProblem problem(cell.networks.front(), data.reduced, cell.adhesion_ids);
  const Trial start = problem.evaluate(cell.tensions_nN);
  const EnsembleFit fit =
      fit_ensemble(cell.networks, std::move(data), cell.adhesion_ids, parameters, work.threads, {}, &start);
  const ErrorBudget budget = error_budget({.fit = fit,
                                           .data = fit.data,
                                           .networks = cell.networks,
                                           .cell = scene.cell.cell,
                                           .gel = scene.fit.gel,
                                           .substrate_error = 0,
                                           .lacks_base = false,
                                           .segmentation = scene.fit.segmentation},
                                          work.threads);
  ModelErrors errors;
  for (const TensionError& t : budget.tensions) errors.tensions.push_back(other_parts(t.parts_nN));
  errors.total_force = other_parts(budget.total_force_parts_nN);
  errors.total_force_nN = total_nN(cell.forces_nN);
  errors.network_force_nN = fit.network_force_nN.value;
  errors.network_force = scaled(errors.tensions.front(), errors.network_force_nN / cell.tensions_nN[0]);
  errors.adhesion_forces_nN.resize(static_cast<Eigen::Index>(fit.forces.magnitudes.size()));
  for (std::size_t a = 0; a < fit.forces.magnitudes.size(); ++a)
    errors.adhesion_forces_nN[static_cast<Eigen::Index>(a)] = fit.forces.magnitudes[a].from_model();
  return errors;
}

namespace {

/// Bead places do not weigh: a noise of 1 um on each.
DisplacementField unit_beads(const std::vector<Vec2>& places_um) {
  DisplacementField beads;
  for (const Vec2 place : places_um)
    beads.push_back({.position_um = place, .displacement_um = {}, .sigma_um = 1, .flag = {}});
  return beads;
}

/// Standard errors of the forces' components along `along`, each force by itself, of a covariance UUᵀ, U by row.
Eigen::VectorXd errors_along(const Eigen::MatrixXd& U, const Eigen::VectorXd& along) {
  Eigen::VectorXd errors(along.size() / 2);
  for (Eigen::Index a = 0; a < errors.size(); ++a) {
    const Eigen::Vector2d e = along.segment<2>(2 * a);
    errors[a] = (e.transpose() * U.middleRows<2>(2 * a)).norm();
  }
  return errors;
}

/// Directions of the forces, x where there is none.
Eigen::VectorXd directions(const Eigen::VectorXd& forces_nN) {
  Eigen::VectorXd along = directions_of(forces_nN);
  for (Eigen::Index row = 0; row < along.size(); row += 2)
    if (along.segment<2>(row).norm() == 0) along[row] = 1;
  return along;
}

/// Sums of squares of the errors, and back.
Precision powers(Precision p, double power) {
  const auto of = [power](double v) { return std::pow(v, power); };
  p.tensions = p.tensions.unaryExpr(of);
  p.adhesion_forces = p.adhesion_forces.unaryExpr(of);
  p.free_forces = p.free_forces.unaryExpr(of);
  p.total_force = of(p.total_force);
  return p;
}

/// a + factor b
Precision sum(const Precision& a, const Precision& b, double factor) {
  const auto of = [factor](const Eigen::VectorXd& x, const Eigen::VectorXd& y) -> Eigen::VectorXd {
    if (x.size() == 0) return factor * y;
    return x + factor * y;
  };
  return {.tensions = of(a.tensions, b.tensions),
          .total_force = a.total_force + factor * b.total_force,
          .adhesion_forces = of(a.adhesion_forces, b.adhesion_forces),
          .free_forces = of(a.free_forces, b.free_forces)};
}

}  // namespace

BeadsOnGel beads_on_gel(const Scene& scene, const KnownCell& cell, double beads_per_um2, std::uint64_t draw,
                        int threads) {
  BeadsOnGel beads{.places_um = beads_on(scene, beads_per_um2, draw),
                   .response = {},
                   .modulus_kPa = scene.fit.gel.youngs_modulus_kPa};
  const auto gel = choice::make_substrate(scene.fit.gel, scene.fit.substrate, threads);
  beads.response = gel->response({cell.ellipses}, {beads.places_um})->kept();
  return beads;
}

BeadsOnGel some_of(const BeadsOnGel& beads, double share, drawing::Random& random) {
  std::vector<Eigen::Index> order(beads.places_um.size());
  std::iota(order.begin(), order.end(), 0);
  for (std::size_t i = order.size(); i > 1; --i) std::swap(order[i - 1], order[random.below(static_cast<int>(i))]);
  order.resize(static_cast<std::size_t>(std::round(share * static_cast<double>(order.size()))));
  std::ranges::sort(order);
  BeadsOnGel some{.places_um = {}, .response = beads.response->at_points(order), .modulus_kPa = beads.modulus_kPa};
  for (const Eigen::Index i : order) some.places_um.push_back(beads.places_um[i]);
  return some;
}

Precision precision_of(const Scene& scene, const KnownCell& cell, const BeadsOnGel& beads, int threads) {
  const DisplacementField unit = unit_beads(beads.places_um);
  const LinearData data = reduce(unit, beads.response, {}, threads,
                                 allows_common_motion(scene.fit.effects) ? affine_motions(unit) : Eigen::MatrixXd());
  const Eigen::VectorXd along = directions(cell.forces_nN);
  Precision mean;
  for (const Eigen::MatrixXd& D : cell.derivatives) {
    const LocalMisfit local{.tensions_nN = cell.tensions_nN,
                            .H = numerics::gram(displace(data.reduced, D)),
                            .g = Eigen::VectorXd::Zero(D.cols())};
    const Eigen::MatrixXd U = numerics::SmallCholesky(response_of(local, 1)).upper().transpose();
    const Eigen::MatrixXd of_forces = numerics::small_product(D, U);
    const Precision of_mesh{.tensions = U.rowwise().norm(),
                            .total_force = numerics::transposed_matvec(of_forces, directions_of(cell.forces_nN)).norm(),
                            .adhesion_forces = errors_along(of_forces, along),
                            .free_forces = Eigen::VectorXd::Zero(along.size() / 2)};
    mean = sum(mean, powers(of_mesh, 2), 1.0 / static_cast<double>(cell.derivatives.size()));
  }
  mean = powers(std::move(mean), 0.5);
  Eigen::MatrixXd U = Eigen::MatrixXd::Identity(along.size(), along.size());
  numerics::solve_upper(*data.reduced.compliance, U, threads);
  mean.free_forces = errors_along(U, along);
  // of this gel's modulus, to 1 kPa
  return sum({}, mean, 1 / beads.modulus_kPa);
}

Densities precision_at(const Scene& scene, const KnownCell& cell, const std::vector<double>& beads_per_um2,
                       const Work& work) {
  constexpr int kDraws = 8;  // a fibre's error differs by a quarter from draw to draw
  Densities result{.beads_per_um2 = beads_per_um2, .precision = std::vector<Precision>(beads_per_um2.size())};
  for (int draw = 0; draw < kDraws; ++draw) {
    work.tell(double(draw) / kDraws, "what beads show");
    const auto index = static_cast<std::uint64_t>(draw);
    const BeadsOnGel densest = beads_on_gel(scene, cell, beads_per_um2.back(), index, work.threads);
    drawing::Random random(scene.experiment.seed, drawing::Stream::beads, index);
    for (std::size_t k = 0; k < beads_per_um2.size(); ++k) {
      const double share = beads_per_um2[k] / beads_per_um2.back();
      const Precision of_draw =
          precision_of(scene, cell, share < 1 ? some_of(densest, share, random) : densest, work.threads);
      result.precision[k] = sum(result.precision[k], powers(of_draw, 2), 1.0 / kDraws);
    }
  }
  for (Precision& p : result.precision) p = powers(std::move(p), 0.5);
  return result;
}

}  // namespace mbtfm::plan
