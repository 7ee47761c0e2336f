/// Tractions that are zero in most places: least squares with the sum of traction magnitudes as penalty (group L1).
#include <algorithm>
#include <cmath>
#include <limits>

#include "mbtfm/tractions/fttc.h"
#include "mbtfm/tractions/lattice_forces.h"
#include "pipeline/contract/errors.h"

namespace mbtfm::tractions {

namespace {

/// Minimises ½ |P G t − u|² + weight Σ |t_i| over tractions even in each cell, for several weights in turn, by
/// alternating directions (Boyd et al., Found. Trends Mach. Learn. 3 (2011) 1, section 6.4): t solves the Tikhonov
/// problem around z − w, z is t + w with all vectors shortened by weight / rho, w gathers what parts t from z.
class GroupLasso {
 public:
  /// @param largest_kPa  about the largest traction: tells the size of a good step, no more
  GroupLasso(const LatticeProblem& problem, double largest_kPa)
      : problem_(problem),
        shortening_kPa_(kShortening * largest_kPa),
        pulled_(problem.pulled_back(problem.spread_data())),
        solver_(problem, pulled_, problem.threads()),
        z_(problem.transform().no_field()),
        w_(z_),
        around_(z_) {}

  Report minimise(double weight) {
    constexpr double kSettled = 2e-3;  // of the tractions: a hundredth of what noise or cells leave open
    constexpr int kMost = 1000;
    // each step asks no more of the inner solution than the outer one can use
    constexpr double kInner = 1e-3;
    Report report{.converged = false, .iterations = 0, .last_change = 1, .reason = {}};
    const double rho = weight / shortening_kPa_;
    w_.x *= rho_ / rho;  // rho w is what stays
    w_.y *= rho_ / rho;
    rho_ = rho;
    for (; report.iterations < kMost && report.last_change > kSettled; ++report.iterations) {
      around_.x = rho * (z_.x - w_.x);
      around_.y = rho * (z_.y - w_.y);
      WaveField right = problem_.transform().forward(around_);
      right.x += pulled_.x;
      right.y += pulled_.y;
      solver_.set_right_hand_side(std::move(right));
      solver_.solve(std::sqrt(rho), kInner);
      report.last_change = shorten(problem_.transform().backward(solver_.solution()));
    }
    report.converged = report.last_change <= kSettled;
    report.reason = report.converged ? "the tractions settled" : "the tractions still change after all steps";
    return report;
  }
  const NodeField& tractions() const { return z_; }
  double misfit() const {
    double sum = 0;
    for (const double d : problem_.residuals(problem_.displaced(problem_.transform().forward(z_)))) sum += d * d;
    return sum;
  }
  /// The weight from which on no traction is left.
  double largest_weight() const {
    const NodeField gradient = problem_.transform().backward(pulled_);
    return std::sqrt((gradient.x.square() + gradient.y.square()).maxCoeff());
  }

 private:
  /// @returns the change, relative
  double shorten(const NodeField& t) {
    double change = 0, size = 0;
    for (Eigen::Index i = 0; i < z_.x.size(); ++i) {
      const double x = t.x[i] + w_.x[i], y = t.y[i] + w_.y[i];
      const double share = std::max(0.0, 1 - shortening_kPa_ / std::max(std::hypot(x, y), 1e-300));
      const double new_x = share * x, new_y = share * y;
      change += std::pow(new_x - z_.x[i], 2) + std::pow(new_y - z_.y[i], 2);
      size += new_x * new_x + new_y * new_y;
      z_.x[i] = new_x;
      z_.y[i] = new_y;
      w_.x[i] = x - new_x;
      w_.y[i] = y - new_y;
    }
    return size > 0 ? std::sqrt(change / size) : 1;
  }
  const LatticeProblem& problem_;
  static constexpr double kShortening = 0.1;  // measured: two to five times as many steps at 0.01 and at 1
  double shortening_kPa_;                     ///< weight / rho
  double rho_ = 1;
  WaveField pulled_;
  TikhonovSolver solver_;
  NodeField z_, w_, around_;
};

struct Choice {
  NodeField tractions;
  double weight = 0, misfit = 0, criterion = 0;
  Report report;
};

/// From where hardly a traction is left, down to the least generalised cross-validation (12); then back to the largest
/// weight that is as good within the criterion's standard error, sqrt(2 / n) of it, as is the custom with such
/// penalties (Hastie, Tibshirani & Friedman, The Elements of Statistical Learning, 7.10). A vector that is not zero
/// takes two degrees of freedom (Yuan & Lin, J. R. Stat. Soc. B 68 (2006) 49, eq. 6.5, from above).
Choice choose_weight(const LatticeProblem& problem, double largest_kPa) {
  constexpr double kLargest = 0.25, kSmallest = 1e-3;  // of the weight at which nothing is left
  constexpr double kStep = 0.7;
  const double tolerance = 1 + std::sqrt(2 / problem.n_data());
  GroupLasso lasso(problem, largest_kPa);
  std::vector<Choice> path;
  double least = std::numeric_limits<double>::infinity();
  const double largest = lasso.largest_weight();
  for (double weight = kLargest * largest; weight > kSmallest * largest; weight *= kStep) {
    const Report report = lasso.minimise(weight);
    const auto n_active = ((lasso.tractions().x != 0) || (lasso.tractions().y != 0)).count();
    const double left = problem.n_data() - 2 * static_cast<double>(n_active);
    const double misfit = lasso.misfit();
    const double criterion = misfit / (left * left);
    if (left <= 0 || criterion > tolerance * least) break;
    least = std::min(least, criterion);
    path.push_back({lasso.tractions(), weight, misfit, criterion, report});
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
  if (!inputs.adhesions.empty()) {
    r.forces = forces_on(
        {.problem = problem, .scan = scan, .compliance = even_forces_um_per_nN(inputs, parameters.gel_model, threads)},
        forces_by_adhesion(r.patches, inputs.adhesions, parameters.grow_um), threads);
  }
  r.relative_l2 = std::sqrt(choice.misfit / problem.data_squared());
  r.figures = {{"lattice_spacing_um", problem.field().spacing_um},
               {"penalty_um2_per_kPa", choice.weight},
               {"n_active_cells", std::int64_t(n_active)}};
  r.report = choice.report;
  return r;
}

}  // namespace mbtfm::tractions
