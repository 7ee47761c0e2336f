#include "mbtfm/force_correction.h"

#include <cmath>

#include "mbtfm/fttc.h"
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

double probe_lambda(const PenalisedTractions& tractions) { return kShare * tractions.lambda_by_gcv; }

/// The variance of a corrected force over that of one datum. Where t = (A + lambda²)⁻¹ G Pᵀ u, the force answers to the
/// data by v = s + m² w with (A + lambda²) w = s, and this is vᵀ A v, exactly; else by s, to first order.
double variance_share(const PenalisedTractions& tractions, const TikhonovSolver& probe) {
  if (!tractions.tikhonov_lambda) return probe.displaced_squared();
  TikhonovSolver second(tractions.problem, probe.solution(), 1);
  second.solve(*tractions.tikhonov_lambda, kTolerance);
  const double lambda2 = std::pow(*tractions.tikhonov_lambda, 2), m2 = std::pow(probe_lambda(tractions), 2);
  const double s_A_w = probe.solution_squared() - lambda2 * second.right_hand_side_times_solution();
  return probe.displaced_squared() + 2 * m2 * s_A_w + m2 * m2 * second.displaced_squared();
}

}  // namespace

WaveField taken_by_penalty(const PenalisedTractions& tractions) {
  const LatticeProblem& problem = tractions.problem;
  NodeField left = problem.transform().no_field();
  problem.normal(tractions.displacements, left);
  left.x = problem.spread_data().x - left.x;
  left.y = problem.spread_data().y - left.y;
  TikhonovSolver solver(problem, problem.pulled_back(left), problem.threads());
  solver.solve(probe_lambda(tractions), kTolerance);
  return solver.solution();
}

std::vector<AdhesionForce> forces_of(const PenalisedTractions& tractions, const std::vector<Vec2>& corrected_kPa,
                                     const std::vector<Adhesion>& adhesions, double grow_um, int threads) {
  const std::vector<Patch> patches = patches_of(tractions.problem, corrected_kPa, tractions.displacements);
  const std::vector<int> owner = adhesion_of_patches(positions_of(patches), adhesions, grow_um);
  std::vector<AdhesionForce> forces = forces_by_adhesion(patches, adhesions, grow_um);
  parallel_for(static_cast<int>(forces.size()), threads, [&](int f) {
    AdhesionForce& force = forces[static_cast<std::size_t>(f)];
    TikhonovSolver probe(tractions.problem, sum_of_force(tractions.problem, owner, f, direction_of(force.force_nN)), 1);
    probe.solve(probe_lambda(tractions), kTolerance);
    const double share = variance_share(tractions, probe);
    if (share > 0) force.sigma_nN = std::sqrt(tractions.variance * share);  // beyond the field nothing is known
  });
  return forces;
}

}  // namespace mbtfm::inverse
