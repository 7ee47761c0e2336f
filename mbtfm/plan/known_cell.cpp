#include "mbtfm/plan/known_cell.h"

#include <algorithm>
#include <cmath>

#include "mbtfm/fit/networks.h"
#include "mbtfm/plan/scene.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/fit_results.h"
#include "pipeline/contract/errors.h"
#include "pipeline/numerics/parallel.h"
#include "samples/experiment/experiment.h"

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

Eigen::VectorXd column_of(const std::vector<AdhesionForce>& forces) {
  Eigen::VectorXd column(2 * static_cast<Eigen::Index>(forces.size()));
  for (std::size_t a = 0; a < forces.size(); ++a)
    column.segment<2>(2 * static_cast<Eigen::Index>(a)) << forces[a].force_nN.x, forces[a].force_nN.y;
  return column;
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
                                           .beads = beads,
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

}  // namespace mbtfm::plan
