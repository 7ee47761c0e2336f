#include "mbtfm/force_correction.h"

#include <cmath>

#include "pipeline/contract/parallel.h"

namespace mbtfm::inverse {

namespace {

constexpr double kTolerance = 1e-2;  // in energy: a hundredth of a standard error

/// m over cross-validation's lambda: what is not put right goes with its square. Measured at 1 to 10 % noise on 64² and
/// 128² beads, for both penalties: at the whole it is seen beside the error (its mean square grows to 2.5 times the
/// stated), and the error itself is half as large again at a quarter as at a half.
constexpr double kShare = 0.5;

/// q: the sum over the nodes of one force of traction times area, along a direction.
WaveField sum_of_force(const LatticeProblem& problem, const std::vector<int>& owner, int force, Vec2 direction) {
  const Lattice &field = problem.field(), &box = problem.box();
  const double area = field.spacing_um * field.spacing_um;
  NodeField q = problem.transform().no_field();
  for (std::size_t p = 0; p < owner.size(); ++p) {
    if (owner[p] != force) continue;
    const auto row = static_cast<Eigen::Index>(p) / field.n_columns,
               column = static_cast<Eigen::Index>(p) % field.n_columns;
    q.x[column + box.n_columns * row] = area * direction.x;
    q.y[column + box.n_columns * row] = area * direction.y;
  }
  return problem.transform().forward(q);
}

/// G Pᵀ (u − P G t): what the tractions have not explained.
WaveField left_over(const LatticeProblem& problem, const NodeField& displacements) {
  NodeField left = problem.transform().no_field();
  problem.normal(displacements, left);
  left.x = problem.spread_data().x - left.x;
  left.y = problem.spread_data().y - left.y;
  return problem.pulled_back(left);
}

/// The variance of a corrected force over that of one datum. Where t = (A + lambda²)⁻¹ G Pᵀ u, the force answers to the
/// data by v = s + m² w with (A + lambda²) w = s, and this is vᵀ A v, exactly; else by s, to first order.
double variance_share(const PenalisedTractions& tractions, const TikhonovSolver& probe, double m) {
  if (!tractions.tikhonov_lambda) return probe.displaced_squared();
  TikhonovSolver second(tractions.problem, probe.solution(), 1);
  second.solve(*tractions.tikhonov_lambda, kTolerance);
  const double lambda2 = std::pow(*tractions.tikhonov_lambda, 2), m2 = m * m;
  const double s_A_w = probe.solution_squared() - lambda2 * second.right_hand_side_times_solution();
  return probe.displaced_squared() + 2 * m2 * s_A_w + m2 * m2 * second.displaced_squared();
}

}  // namespace

void correct_forces(const PenalisedTractions& tractions, const std::vector<int>& owner, int threads,
                    std::vector<AdhesionForce>& forces) {
  const LatticeProblem& problem = tractions.problem;
  const double m = kShare * tractions.lambda_by_gcv;
  const WaveField left = left_over(problem, tractions.displacements);
  parallel_for(static_cast<int>(forces.size()), threads, [&](int f) {
    AdhesionForce& force = forces[static_cast<std::size_t>(f)];
    const Vec2 along = direction_of(force.force_nN), across{-along.y, along.x};
    for (const Vec2 direction : {along, across}) {
      TikhonovSolver probe(problem, sum_of_force(problem, owner, f, direction), 1);
      probe.solve(m, kTolerance);
      force.force_nN += problem.transform().dot(probe.solution(), left) * direction;
      if (direction == across) continue;
      const double share = variance_share(tractions, probe, m);
      if (share > 0) force.sigma_nN = std::sqrt(tractions.variance * share);  // beyond the field nothing is known
    }
  });
}

}  // namespace mbtfm::inverse
