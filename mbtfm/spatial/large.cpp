/// Tikhonov with so many tractions that the matrix of their answers is not formed.
#include <algorithm>
#include <cmath>

#include "mbtfm/spatial/basis.h"
#include "mbtfm/spatial/neighbours.h"
#include "mbtfm/spatial/reconstruction.h"
#include "mbtfm/spatial/rows.h"
#include "mbtfm/tractions/recurrences.h"
#include "pipeline/contract/errors.h"
#include "substrate/response.h"

namespace mbtfm::spatial {

namespace {

/// P W S G L and its transpose, by solutions of the gel.
tractions::LinearMap map_of(const Problem& problem, const Basis& basis, const Rows& rows) {
  const Index n_points = problem.map->rows(), n = problem.observed.n_components();
  tractions::LinearMap map;
  map.n_data = problem.observed.displacement_um.size();
  map.n_unknowns = 3 * basis.size();
  map.forward = [&problem, &basis, &rows](const MatrixXd& x) -> MatrixXd {
    MatrixXd t(problem.n_unknowns(), x.cols());
    for (Index k = 0; k < x.cols(); ++k) t.col(k) = basis.tractions(x.col(k));
    return rows.of(problem.at_beads(problem.map->displace(t)));
  };
  map.transposed = [&problem, &basis, &rows, n_points, n](const MatrixXd& y) -> MatrixXd {
    const MatrixXd weighed = rows.transposed(y);
    MatrixXd at_points = MatrixXd::Zero(n_points, y.cols());
    for (Index b = 0; b < problem.observed.n_beads; ++b) at_points.middleRows(3 * b, n) = weighed.middleRows(n * b, n);
    const MatrixXd pulled = problem.map->pull_back(at_points);
    MatrixXd x(3 * basis.size(), y.cols());
    for (Index k = 0; k < y.cols(); ++k) x.col(k) = basis.transposed(pulled.col(k));
    return x;
  };
  return map;
}

}  // namespace

SpatialReconstruction reconstruct_large(const Problem& problem, const tractions::TractionParameters& traction,
                                        const SpatialParameters& parameters) {
  const Observed& observed = problem.observed;
  const Basis basis =
      orthonormal_basis(norm_of(problem.mesh, problem.ground, [&](Vec2 p) { return problem.expected.amplitude(p); }));
  SpatialReconstruction r;
  r.traction_kPa = VectorXd::Zero(problem.n_unknowns());
  if (observed.displacement_um.isZero(0)) {
    r.remark = "no bead has moved: there is no traction";
    return r;
  }
  // as reconstruct_in() has it: from least squares, and to biweight by way of huber
  const std::vector<double> good = probabilities_of_good(parameters.loss, observed);
  const int n_rounds = parameters.loss == BeadLoss::l2 ? 1 : good.empty() ? 5 : 2;
  r.weighing = weigh(BeadLoss::l2, observed, observed.displacement_um.cwiseQuotient(observed.sigma_um), 0);
  for (int round = 0; round < n_rounds; ++round) {
    const Rows rows(problem, r.weighing.by_row);
    const tractions::Recurrences recurrences(map_of(problem, basis, rows), rows.of(observed.displacement_um), {});
    r.scan = recurrences.scan(stated_variance(problem, parameters.loss, r.weighing));
    const ChosenLambda chosen = choose_lambda(problem, *r.scan, traction, RiskIs::unsound);
    r.lambda = chosen.lambda;
    r.lambda_by = chosen.by;
    r.findings = {chosen.finding};
    r.traction_kPa = basis.tractions(recurrences.solve(*r.lambda));
    r.degrees = recurrences.degrees(*r.lambda);
    r.relative_l2 = recurrences.relative_l2(*r.lambda);
    const bool is_on_its_way = parameters.loss == BeadLoss::biweight && round < 2;
    r.weighing = weigh(is_on_its_way ? BeadLoss::huber : parameters.loss, observed,
                       problem.residual(r.traction_kPa, r.weighing.by_row), r.degrees, good);
  }
  r.variance =
      std::max(weighs_by_residual(parameters.loss) ? r.weighing.variance : r.scan->variance, problem.least_variance());
  r.length_um = *r.lambda / lambda_per_um_per_kPa(problem) * problem.gel.youngs_modulus_kPa;
  r.remark = "standard errors are computed of up to " + std::to_string(kMostVertices) + " vertices, and there are " +
             std::to_string(problem.mesh.n_vertices());
  return r;
}

}  // namespace mbtfm::spatial
