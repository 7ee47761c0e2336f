/// Tractions that are zero in most places: least squares with the sum of traction magnitudes as penalty (group L1)
/// finds the places, a smooth fit on those places finds the tractions.
#include <Eigen/SparseCore>
#include <algorithm>
#include <cmath>
#include <limits>

#include "mbtfm/inverse/group_lasso.h"
#include "mbtfm/inverse/spectrum.h"
#include "mbtfm/tractions/fttc.h"
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
  double weight = 0, criterion = 0;
  Report report;
};

/// From where hardly a traction is left, down to the least generalised cross-validation
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
    const double misfit = problem.residuals(problem.displaced(transform.forward(tractions))).squaredNorm();
    const double criterion = misfit / (left * left);
    if (left <= 0 || criterion > tolerance * least) break;
    least = std::min(least, criterion);
    path.push_back({tractions, weight, criterion, report});
  }
  return *std::find_if(path.begin(), path.end(), [&](const Choice& c) { return c.criterion <= tolerance * least; });
}

/// Nodes of the box in a disc around each of some nodes.
class Neighbours {
 public:
  Neighbours(const Lattice& box, double radius) : box_(box) {  // radius in spacings
    const int reach = static_cast<int>(radius);
    for (int q = -reach; q <= reach; ++q)
      for (int p = -reach; p <= reach; ++p)
        if (p * p + q * q <= radius * radius) offsets_.emplace_back(p, q);
  }
  /// @param use  of the neighbour's index and its squared distance in spacings
  template <class Use>
  void visit(Index node, const Use& use) const {
    const auto column = static_cast<int>(node % box_.n_columns), row = static_cast<int>(node / box_.n_columns);
    for (const auto& [p, q] : offsets_)
      use((column + p + box_.n_columns) % box_.n_columns +
              static_cast<Index>(box_.n_columns) * ((row + q + box_.n_rows) % box_.n_rows),
          p * p + q * q);
  }

 private:
  const Lattice& box_;
  std::vector<std::pair<int, int>> offsets_;
};

/// Nodes with a traction and those within `reach` spacings of one.
std::vector<Index> grown_support(const Lattice& box, const NodeField& tractions, double reach) {
  std::vector<bool> is_in(static_cast<std::size_t>(box.n_nodes()), false);
  const Neighbours neighbours(box, reach);
  for (Index k = 0; k < box.n_nodes(); ++k)
    if (tractions.x[k] != 0 || tractions.y[k] != 0) neighbours.visit(k, [&](Index other, int) { is_in[other] = true; });
  std::vector<Index> nodes;
  for (Index k = 0; k < box.n_nodes(); ++k)
    if (is_in[k]) nodes.push_back(k);
  return nodes;
}

/// Sums over Gaussians of this deviation (spacings) on these nodes: two rows and columns a node. 0: the identity.
Eigen::SparseMatrix<double> smoothing(const Lattice& box, const std::vector<Index>& nodes, double deviation) {
  constexpr double kReach = 3;  // deviations
  std::vector<Index> at(static_cast<std::size_t>(box.n_nodes()), -1);
  for (Index k = 0; k < std::ssize(nodes); ++k) at[nodes[k]] = k;
  const Neighbours neighbours(box, kReach * deviation);
  std::vector<Eigen::Triplet<double>> entries;
  for (Index k = 0; k < std::ssize(nodes); ++k)
    neighbours.visit(nodes[k], [&](Index other, int squared) {
      if (at[other] < 0) return;
      const double share = squared > 0 ? std::exp(-0.5 * squared / (deviation * deviation)) : 1;
      for (const Index c : {0, 1}) entries.emplace_back(2 * k + c, 2 * at[other] + c, share);
    });
  Eigen::SparseMatrix<double> matrix(2 * std::ssize(nodes), 2 * std::ssize(nodes));
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

NodeField on_box(const LatticeProblem& problem, const std::vector<Index>& nodes, const VectorXd& tractions) {
  NodeField field = problem.transform().no_field();
  for (Index k = 0; k < std::ssize(nodes); ++k) {
    field.x[nodes[k]] = tractions[2 * k];
    field.y[nodes[k]] = tractions[2 * k + 1];
  }
  return field;
}

/// Smoothed tractions on some nodes to weighted components of the beads. Refers to all of its arguments.
LinearMap map_on(const LatticeProblem& problem, const std::vector<Index>& nodes,
                 const Eigen::SparseMatrix<double>& smooth) {
  return {.forward =
              [&](const MatrixXd& unknowns) {
                MatrixXd moved(static_cast<Index>(problem.n_data()), unknowns.cols());
                for (Index c = 0; c < unknowns.cols(); ++c)
                  moved.col(c) = problem.at_beads(
                      problem.displaced(problem.transform().forward(on_box(problem, nodes, smooth * unknowns.col(c)))));
                return moved;
              },
          .transposed =
              [&](const MatrixXd& components) {
                MatrixXd adjoint(smooth.rows(), components.cols());
                for (Index c = 0; c < components.cols(); ++c) {
                  const NodeField t =
                      problem.transform().backward(problem.pulled_back(problem.spread(components.col(c))));
                  for (Index k = 0; k < std::ssize(nodes); ++k)
                    adjoint.col(c).segment<2>(2 * k) << t.x[nodes[k]], t.y[nodes[k]];
                  adjoint.col(c) = smooth * adjoint.col(c).eval();  // symmetric
                }
                return adjoint;
              },
          .n_data = static_cast<Index>(problem.n_data()),
          .n_unknowns = smooth.rows()};
}

struct Refit {
  NodeField tractions;
  std::size_t n_nodes = 0;
  double deviation_um = 0;  ///< of the Gaussians
};

/// The penalty that finds the places makes tractions smaller, and gathers them in single nodes as the beads do not
/// resolve neighbours. So tractions are fitted once more (Meinshausen, Comput. Stat. Data Anal. 52 (2007) 374), on
/// these places and those within a bead distance: sums of Gaussians with a Tikhonov penalty by evidence (14). Their
/// width, in bead distances, is the largest that is as good in (12) as the best within its standard error. Where each
/// node has its bead, L1 alone does as well, and better without noise: its tractions stay.
Refit refit(const LatticeProblem& problem, const NodeField& tractions, double bead_distance_um) {
  constexpr double kFiner = 1.5;  // bead distances over the spacing: scattered beads have 2, those on a lattice 1
  constexpr double kDeviations[] = {0, 0.5, 0.7, 1, 1.4, 2, 2.8};
  constexpr double kHopeless = 1.1;  // of the least criterion: wider ones are worse still
  constexpr RecurrenceOptions kRecurrences{.steps = 64, .probes = 4, .seed = 1};
  const double tolerance = 1 + std::sqrt(2 / problem.n_data());
  const Lattice& box = problem.box();
  const double distance = bead_distance_um / box.spacing_um;
  const std::vector<Index> nodes = grown_support(box, tractions, std::max(1.0, std::round(distance)));
  Refit best{.tractions = tractions, .n_nodes = nodes.size(), .deviation_um = 0};
  if (distance < kFiner) {
    best.n_nodes = static_cast<std::size_t>((tractions.x != 0 || tractions.y != 0).count());
    return best;
  }
  double least = std::numeric_limits<double>::infinity();
  for (const double deviation : kDeviations) {
    const Eigen::SparseMatrix<double> smooth = smoothing(box, nodes, deviation * distance);
    const Recurrences recurrences(map_on(problem, nodes, smooth), problem.data(), kRecurrences);
    const LambdaScan scan = recurrences.scan(problem.stated_variance());
    const double criterion = *std::min_element(scan.gcv.begin(), scan.gcv.end());
    if (criterion > kHopeless * least) break;
    if (criterion > tolerance * least) continue;
    least = std::min(least, criterion);
    best.tractions = on_box(problem, nodes, smooth * recurrences.solve(scan.by_evidence));
    best.deviation_um = deviation * bead_distance_um;
  }
  return best;
}

}  // namespace

Reconstruction reconstruct_sparse(const TractionInputs& inputs, const TractionParameters& parameters, int threads) {
  if (parameters.lambda_um_per_kPa) {
    throw UsageError(
        "sparse: lambda_um_per_kPa belongs to the other methods; this one has a penalty of its own, chosen by "
        "cross-validation");
  }
  const LatticeProblem problem(inputs.beads, inputs.gel, lattice_options(parameters, threads));
  if (problem.data().isZero(0)) return reconstruction_of_nothing(problem, inputs);
  TikhonovSolver smooth(problem);
  const LambdaScan scan = scan_lambda(problem, smooth);
  smooth.solve(scan.by_risk, 1e-2);
  const NodeField t = problem.transform().backward(smooth.solution());
  const Choice choice = choose_weight(problem, std::sqrt((t.x.square() + t.y.square()).maxCoeff()));

  const Refit fit = refit(problem, choice.tractions, 1 / std::sqrt(beads_per_um2(inputs.beads)));

  Reconstruction r;
  const NodeField displacements = problem.displaced(problem.transform().forward(fit.tractions));
  r.patches = patches_of(problem, on_field(problem, fit.tractions), displacements);
  r.forces = forces_beside(problem, scan, r.patches, inputs, parameters, threads);
  r.relative_l2 = problem.residuals(displacements).norm() / problem.data().norm();
  r.figures = {{"lattice_spacing_um", problem.field().spacing_um},
               {"penalty_um2_per_kPa", choice.weight},
               {"n_active_cells", static_cast<std::int64_t>(fit.n_nodes)},
               {"smoothed_over_um", fit.deviation_um}};
  r.report = choice.report;
  return r;
}

}  // namespace mbtfm::tractions
