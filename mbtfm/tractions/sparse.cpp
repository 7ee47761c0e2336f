/// Tractions that are zero in most places: least squares with the sum of traction magnitudes as penalty (group L1).
#include <algorithm>
#include <cmath>
#include <limits>

#include "mbtfm/tractions/fttc.h"
#include "mbtfm/tractions/group_lasso.h"
#include "pipeline/contract/errors.h"

namespace mbtfm::tractions {

namespace {

NodeField nodes_of(const VectorXd& t) { return {t.head(t.size() / 2), t.tail(t.size() / 2)}; }

VectorXd column_of(const NodeField& t) {
  VectorXd column(2 * t.x.size());
  column << t.x.matrix(), t.y.matrix();
  return column;
}

struct Choice {
  NodeField tractions;
  double weight = 0, misfit = 0, criterion = 0;
  Report report;
};

/// Of tractions even in each cell. From where hardly a traction is left, down to the least generalised cross-validation
/// (12); then back to the largest weight that is as good within the criterion's standard error, sqrt(2 / n) of it, as
/// is the custom with such penalties (Hastie, Tibshirani & Friedman, The Elements of Statistical Learning, 7.10). A
/// vector that is not zero takes two degrees of freedom (Yuan & Lin, J. R. Stat. Soc. B 68 (2006) 49, eq. 6.5, from
/// above).
Choice choose_weight(const LatticeProblem& problem, double largest_kPa) {
  constexpr double kLargest = 0.25, kSmallest = 1e-3;  // of the weight at which nothing is left
  constexpr double kStep = 0.7;
  const double tolerance = 1 + std::sqrt(2 / problem.n_data());
  // each step asks no more of the inner solution than the outer one can use
  constexpr double kInner = 1e-3;
  // of the tractions: a hundredth of what noise or cells leave open
  constexpr Settled kSettled{.change = 2e-3, .gap = std::numeric_limits<double>::infinity(), .most_steps = 1000};
  const WaveTransform& transform = problem.transform();
  const WaveField pulled = problem.pulled_back(problem.spread_data());
  const VectorXd gradient = column_of(transform.backward(pulled));
  const Index n_nodes = problem.box().n_nodes();
  TikhonovSolver solver(problem, pulled, problem.threads());
  const auto solve = [&](const VectorXd& added, double rho) {
    WaveField right = transform.forward(nodes_of(added));
    right.x += pulled.x;
    right.y += pulled.y;
    solver.set_right_hand_side(std::move(right));
    solver.solve(std::sqrt(rho), kInner);
    return column_of(transform.backward(solver.solution()));
  };
  GroupLasso lasso(solve, gradient.size(), Eigen::ArrayXd::Ones(n_nodes), largest_kPa, kSettled);
  std::vector<Choice> path;
  double least = std::numeric_limits<double>::infinity();
  const double largest = lengths_of(gradient, n_nodes).maxCoeff();  // from which on nothing is left
  for (double weight = kLargest * largest; weight > kSmallest * largest; weight *= kStep) {
    const Report report = lasso.minimise(weight);
    const auto n_active = (lengths_of(lasso.x(), n_nodes) > 0).count();
    const double left = problem.n_data() - 2 * static_cast<double>(n_active);
    const NodeField tractions = nodes_of(lasso.x());
    double misfit = 0;
    for (const double d : problem.residuals(problem.displaced(transform.forward(tractions)))) misfit += d * d;
    const double criterion = misfit / (left * left);
    if (left <= 0 || criterion > tolerance * least) break;
    least = std::min(least, criterion);
    path.push_back({tractions, weight, misfit, criterion, report});
  }
  return *std::find_if(path.begin(), path.end(), [&](const Choice& c) { return c.criterion <= tolerance * least; });
}

}  // namespace

Reconstruction reconstruct_sparse(const TractionInputs& inputs, const TractionParameters& parameters, int threads) {
  if (parameters.lambda_um_per_kPa) {
    throw UsageError(
        "sparse: lambda_um_per_kPa belongs to the other methods; this one has a penalty of its own, chosen by "
        "cross-validation");
  }
  LatticeOptions options = lattice_options(parameters, threads);
  options.basis = Basis::cells;
  const LatticeProblem problem(inputs.beads, inputs.gel, options);
  if (problem.data_squared() == 0) return reconstruction_of_nothing(problem, inputs);
  TikhonovSolver smooth(problem);
  const LambdaScan scan = scan_lambda(problem, smooth);
  smooth.solve(scan.by_risk, 1e-2);
  const NodeField t = problem.transform().backward(smooth.solution());
  const Choice choice = choose_weight(problem, std::sqrt((t.x.square() + t.y.square()).maxCoeff()));

  Reconstruction r;
  const NodeField displacements = problem.displaced(problem.transform().forward(choice.tractions));
  const std::vector<Vec2> tractions = on_field(problem, choice.tractions);
  const auto n_active =
      std::count_if(tractions.begin(), tractions.end(), [](Vec2 traction) { return norm(traction) > 0; });
  r.patches = patches_of(problem, tractions, displacements);
  r.forces = forces_beside(problem, scan, r.patches, inputs, parameters, threads);
  r.relative_l2 = std::sqrt(choice.misfit / problem.data_squared());
  r.figures = {{"lattice_spacing_um", problem.field().spacing_um},
               {"penalty_um2_per_kPa", choice.weight},
               {"n_active_cells", std::int64_t(n_active)}};
  r.report = choice.report;
  return r;
}

}  // namespace mbtfm::tractions
