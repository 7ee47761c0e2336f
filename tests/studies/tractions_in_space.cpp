/// How exact tractions in space are, on scenes whose truth is exact: tractions_in_space FOLDER SCENE...
/// The bars beside the numbers are those of an independent dense inversion (docs/developers/tractions_in_space.md).
#include <cstdio>
#include <iostream>
#include <map>
#include <string>

#include "mbtfm/spatial/reconstruction.h"
#include "tests/support/traction_scene.h"

namespace {

using namespace mbtfm;
using spatial::BeadLoss;
using test::ForceErrors;
using test::TractionScene;

struct Known {
  const TractionScene& scene;
  spatial::Problem problem;
  Eigen::MatrixXd areas_um2;

  void observe(double noise, double astray, const spatial::SpatialParameters& parameters) {
    std::vector<BeadInSpace> beads = scene.observed(noise, astray);
    problem.observed = spatial::observe(beads, scene.gel, problem.ground, parameters);
  }
  ForceErrors forces(const spatial::SpatialReconstruction& r) const {
    return test::force_errors(scene, forces_on(problem, r, areas_um2));
  }
};

/// The map with the lambda that an oracle would take, and the forces with it.
double best_map_error(const Known& known) {
  const spatial::Problem& p = known.problem;
  const auto basis =
      spatial::orthonormal_basis(norm_of(p.mesh, p.ground, [&](Vec2 at) { return p.expected.amplitude(at); }));
  const Eigen::VectorXd ones = Eigen::VectorXd::Ones(p.observed.displacement_um.size());
  const auto spectrum =
      spectrum_of(p, basis.response(p.response_um_per_kPa, 2), ones, static_cast<double>(ones.size()), 2);
  double best = 1;
  const double largest = std::sqrt(spectrum.values().maxCoeff());
  for (double lambda = 0.3 * largest; lambda > 1e-4 * largest; lambda *= 0.89)
    best = std::min(best, test::map_error(known.scene, p.mesh, basis.tractions(spectrum.solve(lambda))));
  return best;
}

void tell(const Known& known, const char* what, double noise, double astray, const spatial::SpatialReconstruction& r,
          double best) {
  const double error = test::map_error(known.scene, known.problem.mesh, r.traction_kPa);
  const ForceErrors forces = known.forces(r);
  const spatial::Balance balance = balance_of(known.problem, r);
  std::printf(
      "%-12s %-11s noise %.2f astray %.1f  map %.3f (%.2f x best)  forces %.3f  error/stated %.2f  total %.0f nN  "
      "net %.0f +- %.0f nN  energy %.0f fJ  degrees %.0f"
      "  scale %.2f  lambda %.3g (%s; risk %.3g evidence %.3g gcv %.3g; sums %.3g)\n",
      known.scene.name.c_str(), what, noise, astray, error, best > 0 ? error / best : 0.0, forces.mean,
      forces.over_stated, balance.total_force_nN, norm(balance.force_nN), norm(balance.force_sigma_nN),
      balance.strain_energy_fJ, r.degrees, r.weighing.scale, r.lambda.value_or(0),
      r.lambda_by ? name_of(*r.lambda_by) : "-", r.scan ? r.scan->by_risk : 0.0, r.scan ? r.scan->by_evidence : 0.0,
      r.scan ? r.scan->by_gcv : 0.0, r.summands ? r.summands->lambda.value_or(0) : 0.0);
  std::fflush(stdout);
}

void study(const TractionScene& scene) {
  spatial::SpatialParameters parameters;
  spatial::SpatialInputs inputs{scene.observed(0.02), scene.gel, {}, {}};
  substrate::SubstrateParameters gel;
  Known known{scene, make_problem(inputs, parameters, {}, gel, 2), {}};
  known.areas_um2 = patch_areas_um2(scene, known.problem);
  std::printf("%s: %ld unknowns, spacing %.2f um, beads %.2f um apart, model error %.4f\n", scene.name.c_str(),
              static_cast<long>(known.problem.n_unknowns()), known.problem.mesh.spacing_um.x,
              known.problem.observed.distance_um, known.problem.model_error);
  const tractions::TractionParameters traction;
  for (const double noise : {0.0, 0.02, 0.05, 0.1, 0.2}) {
    known.observe(noise, 0, parameters);
    const double best = best_map_error(known);
    tell(known, "tikhonov", noise, 0, reconstruct_tikhonov(known.problem, traction, parameters, 2), best);
    tell(known, "group-l1", noise, 0, reconstruct_group_l1(known.problem, traction, parameters, 2), best);
  }
  for (const BeadLoss loss :
       {BeadLoss::l2, BeadLoss::l1, BeadLoss::huber, BeadLoss::biweight, BeadLoss::l1_by_component}) {
    parameters.loss = loss;
    for (const double astray : {0.0, 0.1, 0.3}) {
      known.observe(0.1, astray, parameters);
      tell(known, name_of(loss), 0.1, astray, reconstruct_tikhonov(known.problem, traction, parameters, 2), 0);
      if (loss == BeadLoss::biweight)
        tell(known, "group-l1 bw", 0.1, astray, reconstruct_group_l1(known.problem, traction, parameters, 2), 0);
    }
  }
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) {
    std::cerr << "usage: tractions_in_space FOLDER SCENE...\n";
    return 2;
  }
  for (int k = 2; k < argc; ++k) study(test::traction_scene(std::filesystem::path(argv[1]) / argv[k]));
}
