#include "mbtfm/spatial/strained.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/report.h"
#include "substrate/choice/factory.h"
#include "substrate/choice/large_strain.h"

namespace mbtfm::spatial {

double mean_traction_kPa(const Problem& problem, const VectorXd& traction_kPa) {
  double fourth = 0, square = 0;
  for (Index v = 0; v < problem.mesh.n_vertices(); ++v) {
    const double t2 = traction_kPa.segment<3>(3 * v).squaredNorm();
    const double area = problem.mesh.areas_um2[v];
    square += area * t2;
    fourth += area * t2 * t2;
  }
  return square > 0 ? std::sqrt(fourth / square) : 0;
}

Effect decide_strain(const Problem& problem, const VectorXd& traction_kPa, const substrate::SubstrateParameters& gel) {
  return choice::decide_large_strain(gel,
                                     choice::left_out_in_gel(problem.gel, mean_traction_kPa(problem, traction_kPa)));
}

Strained on_strained_gel(const Problem& at_rest, SpatialReconstruction found, const substrate::SubstrateParameters& gel,
                         const std::function<SpatialReconstruction(const Problem&)>& again, int threads) {
  constexpr int kMostSteps = 8;
  constexpr double kSettled = 0.01;  // of the tractions: far below what noise makes of them
  substrate::SubstrateParameters of_model = gel;
  of_model.model = substrate::ModelKind::curved;
  of_model.effects.large_strain = Switch::on;
  const auto model = choice::make_substrate(at_rest.gel, of_model, threads);
  const auto response = response_of_vertices(*model, at_rest);
  Strained strained{at_rest, std::move(found), 0};
  double change = 1;
  for (; change > kSettled && strained.steps < kMostSteps; ++strained.steps) {
    const VectorXd before = strained.reconstruction.traction_kPa;
    const substrate::Tangent tangent = response->about(before);
    strained.problem = at_rest.with_response(tangent.response->matrix(), tangent.displacement_um, before);
    strained.reconstruction = again(strained.problem);
    const VectorXd& now = strained.reconstruction.traction_kPa;
    change = (now - before).norm() / std::max(now.norm(), 1e-300);
  }
  if (change > kSettled) {
    throw NotSolved({.reason = "the tractions did not settle on the strained gel in " + std::to_string(kMostSteps) +
                               " steps: switch effects.large_strain off"});
  }
  strained.problem.figures = model->figures();
  return strained;
}

}  // namespace mbtfm::spatial
