#include "mbtfm/tractions/fttc.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <utility>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::tractions {

std::vector<double> lambdas_of(const LatticeProblem& problem) {
  // From tractions that only the longest waves of the field show to those that its shortest waves show: beyond
  // either end nothing changes.
  return lambdas_between(2 * problem.longest_wave_um_per_kPa(), problem.spectrum().smallest_um_per_kPa());
}

LambdaScan scan_lambda(const LatticeProblem& problem, TikhonovSolver& solver) {
  std::optional<TikhonovSolver> probe;
  if (!problem.is_complete()) probe.emplace(problem, problem.pulled_back(problem.spread_signs()), problem.threads());
  const auto degrees_of = [&](double lambda, int power) {
    if (!probe) {
      const auto shares = [&](const Eigen::ArrayXd& compliance) -> Eigen::ArrayXd {
        const Eigen::ArrayXd h = 1 / (1 + lambda * lambda / compliance.square());
        return power == 1 ? h : h.square();
      };
      return 0.5 * problem.n_data() *
             (problem.transform().weights() *
              (shares(problem.spectrum().along_um_per_kPa()) + shares(problem.spectrum().across_um_per_kPa())))
                 .sum();
    }
    return power == 1 ? probe->right_hand_side_times_solution() : probe->displaced_squared();
  };
  std::vector<ScanPoint> points;
  for (const double lambda : lambdas_of(problem)) {
    solver.solve(lambda, kScanTolerance);
    if (probe) probe->solve(lambda, kScanTolerance);
    const double misfit =
        problem.data().squaredNorm() - 2 * solver.right_hand_side_times_solution() + solver.displaced_squared();
    points.push_back(
        {.lambda = lambda, .misfit = misfit, .norm = solver.solution_squared(), .degrees = degrees_of(lambda, 1)});
  }
  const auto variance_left_at = [&](double lambda) {
    solver.solve(lambda, kScanTolerance);
    if (probe) probe->solve(lambda, kScanTolerance);
    return robust_variance(problem.residuals(problem.displaced(solver.solution())), degrees_of(lambda, 1),
                           degrees_of(lambda, 2));
  };
  return judge(std::move(points), problem.n_data(), problem.stated_variance(), variance_left_at,
               unbiased_risks(problem.n_data()));
}

LatticeOptions lattice_options(const TractionParameters& p, int threads) {
  return {.model = p.gel_model, .spacing_um = p.spacing_um, .padding = p.padding, .threads = threads};
}

std::vector<GroundPatch> patches_of(const LatticeProblem& problem, const std::vector<Vec2>& tractions,
                                    const NodeField& displacements) {
  const Lattice& field = problem.field();
  const std::vector<Vec2> displacements_um = on_field(problem, displacements);
  std::vector<GroundPatch> patches;
  for (int k = 0; k < static_cast<int>(field.n_nodes()); ++k)
    patches.push_back({.position_um = field.position_um(k % field.n_columns, k / field.n_columns),
                       .area_um2 = field.spacing_um * field.spacing_um,
                       .traction_kPa = tractions[k],
                       .displacement_um = displacements_um[k]});
  return patches;
}

std::vector<Vec2> on_field(const LatticeProblem& problem, const NodeField& nodes) {
  std::vector<Vec2> vectors;
  for (int j = 0; j < problem.field().n_rows; ++j) {
    for (int i = 0; i < problem.field().n_columns; ++i) {
      const Eigen::Index at = i + static_cast<Eigen::Index>(problem.box().n_columns) * j;
      vectors.push_back({nodes.x[at], nodes.y[at]});
    }
  }
  return vectors;
}

Reconstruction reconstruction_of_nothing(const LatticeProblem& problem, const TractionInputs& inputs) {
  Reconstruction r;
  r.remark = "no bead has moved: there is no traction";
  const std::vector<Vec2> nothing(static_cast<std::size_t>(problem.field().n_nodes()));
  r.patches = patches_of(problem, nothing, problem.transform().no_field());
  r.forces = forces_by_adhesion(r.patches, inputs.adhesions, 0);
  return r;
}

Reconstruction reconstruct_fttc(const TractionInputs& inputs, const TractionParameters& parameters, int threads) {
  const LatticeProblem problem(inputs.beads, inputs.gel, lattice_options(parameters, threads));
  if (problem.data().isZero(0)) return reconstruction_of_nothing(problem, inputs);
  Reconstruction r;
  r.lambda_unit = LambdaUnit::um_per_kPa;
  TikhonovSolver solver(problem);
  r.scan = scan_lambda(problem, solver);
  r.lambda = parameters.lambda_um_per_kPa.value_or(chosen_lambda(*r.scan, parameters.lambda_by));
  r.length_um = *r.lambda * inputs.gel.youngs_modulus_kPa;
  solver.solve(*r.lambda, kTolerance);
  const WaveField waves = solver.solution();
  const NodeField displacements = problem.displaced(waves);
  r.patches =
      patches_of(problem, tractions_kPa(problem, waves, parameters.read_out, parameters.gaussian_um), displacements);
  r.relative_l2 = problem.residuals(displacements).norm() / problem.data().norm();
  if (inputs.point_errors == PointErrors::stated)
    r.sigmas_kPa = drawn_errors_kPa(problem, *r.scan, *r.lambda, parameters, threads);
  r.forces = forces_beside(problem, *r.scan, r.patches, inputs, parameters, threads);
  r.figures = {{"lattice_spacing_um", problem.field().spacing_um},
               {"lattice_columns", std::int64_t(problem.field().n_columns)},
               {"lattice_rows", std::int64_t(problem.field().n_rows)}};
  return r;
}

WaveField smoothed(const LatticeProblem& problem, WaveField waves, ReadOut read_out, double gaussian_um) {
  const Lattice& box = problem.box();
  const auto factors = [&](int n_waves, int n_nodes) {  // along one axis: both smoothings are products over the two
    Eigen::ArrayXd f(n_waves);
    for (int i = 0; i < n_waves; ++i) {
      const double turn =
          std::numbers::pi * (2 * i <= n_nodes ? i : i - n_nodes) / n_nodes;  // half the phase to the next node
      f[i] = (read_out == ReadOut::cells ? sinc(turn) : 1) *
             std::exp(-2 * std::pow(turn / box.spacing_um * gaussian_um, 2));
    }
    return f;
  };
  const int n_half = problem.transform().n_half();
  const Eigen::ArrayXd by_column = factors(n_half, box.n_columns), by_row = factors(box.n_rows, box.n_rows);
  for (int j = 0; j < box.n_rows; ++j) {
    const Eigen::Index row = static_cast<Eigen::Index>(n_half) * j;
    waves.x.segment(row, n_half) *= by_row[j] * by_column;
    waves.y.segment(row, n_half) *= by_row[j] * by_column;
  }
  return waves;
}

std::vector<Vec2> tractions_kPa(const LatticeProblem& problem, const WaveField& waves, ReadOut read_out,
                                double gaussian_um) {
  return on_field(problem,
                  problem.transform().backward(smoothed(problem, waves, read_out, gaussian_um), problem.threads()));
}

// Errors by point of a map, by drawing.

namespace {

constexpr int kDraws = 24;

/// Means around each node, never negative. @param deviation_um  of the Gaussian
NodeField local_means(const LatticeProblem& problem, const NodeField& values, double deviation_um) {
  const WaveTransform& transform = problem.transform();
  NodeField means = transform.backward(smoothed(problem, transform.forward(values), ReadOut::points, deviation_um));
  means.x = means.x.max(0);
  means.y = means.y.max(0);
  return means;
}

/// White noise of the data's variance, weighted components.
Eigen::VectorXd drawn_noise(const LatticeProblem& problem, double variance, std::mt19937_64& random) {
  std::normal_distribution<double> normal(0, std::sqrt(variance));
  Eigen::VectorXd noise(static_cast<Eigen::Index>(problem.n_data()));
  for (double& u : noise) u = normal(random);
  return noise;
}

NodeField solution_for(const LatticeProblem& problem, TikhonovSolver& solver, double lambda) {
  solver.solve(lambda, kScanTolerance);
  return problem.transform().backward(solver.solution());
}

/// How large tractions are around each node: those by evidence, less what noise makes of nothing there.
NodeField deviations_kPa(const LatticeProblem& problem, const LambdaScan& scan, double around_um) {
  std::mt19937_64 random(0);
  TikhonovSolver of_data(problem);
  TikhonovSolver of_noise(problem, problem.pulled_back(problem.spread(drawn_noise(problem, scan.variance, random))),
                          problem.threads());
  const NodeField t = solution_for(problem, of_data, scan.by_evidence);
  double by_noise = 0;
  for (const Vec2 v : on_field(problem, solution_for(problem, of_noise, scan.by_evidence)))
    by_noise += 0.5 * dot(v, v) / static_cast<double>(problem.field().n_nodes());
  const NodeField squares = local_means(problem, {t.x.square(), t.y.square()}, around_um);
  return {(squares.x - by_noise).max(0).sqrt(), (squares.y - by_noise).max(0).sqrt()};
}

}  // namespace

std::vector<Vec2> drawn_errors_kPa(const LatticeProblem& problem, const LambdaScan& scan, double lambda,
                                   const TractionParameters& parameters, int threads) {
  const WaveTransform& transform = problem.transform();
  const Lattice &box = problem.box(), &field = problem.field();
  // of two bead distances: less does not know the size of tractions, more mixes adhesions with what is beside them
  const double bead_distance_um =
      field.spacing_um * std::sqrt(static_cast<double>(field.n_nodes()) / (0.5 * problem.n_data()));
  const NodeField deviations = deviations_kPa(problem, scan, bead_distance_um);
  std::vector<std::vector<Vec2>> errors(kDraws);
  numerics::parallel_for(kDraws, threads, [&](int draw) {
    std::mt19937_64 random(static_cast<std::uint64_t>(draw) + 1);
    std::normal_distribution<double> normal;
    NodeField truth = deviations;
    for (auto* part : {&truth.x, &truth.y})
      for (double& value : *part) value *= normal(random);
    const WaveField waves = transform.forward(truth);
    const Eigen::VectorXd displacements =
        problem.at_beads(problem.displaced(waves)) + drawn_noise(problem, scan.variance, random);
    TikhonovSolver solver(problem, problem.pulled_back(problem.spread(displacements)), 1);
    solver.solve(lambda, kScanTolerance);
    errors[draw] = tractions_kPa(problem, solver.solution(), parameters.read_out, parameters.gaussian_um);
    const std::vector<Vec2> exact = tractions_kPa(problem, waves, parameters.read_out, 0);
    for (std::size_t k = 0; k < exact.size(); ++k) errors[draw][k] = errors[draw][k] - exact[k];
  });
  NodeField squares = transform.no_field();
  squares.x.setZero();
  squares.y.setZero();
  for (const std::vector<Vec2>& of_draw : errors)
    for (std::size_t k = 0; k < of_draw.size(); ++k) {
      const auto node = static_cast<Eigen::Index>(k);
      const Eigen::Index at =
          node % field.n_columns + static_cast<Eigen::Index>(box.n_columns) * (node / field.n_columns);
      squares.x[at] += of_draw[k].x * of_draw[k].x / kDraws;
      squares.y[at] += of_draw[k].y * of_draw[k].y / kDraws;
    }
  std::vector<Vec2> sigmas;
  for (const Vec2 v : on_field(problem, local_means(problem, squares, 0.5 * bead_distance_um)))
    sigmas.push_back({std::sqrt(v.x), std::sqrt(v.y)});
  return sigmas;
}

namespace {

/// What is known of the forces for one m, with the s² that makes the data most likely.
struct Known {
  double log_likelihood = -std::numeric_limits<double>::infinity();  ///< of the forces' part
  VectorXd mean;
  MatrixXd covariance;
};

Known known_from(const BesideBackground::Normal& normal, double variance) {
  const auto [values, vectors] = numerics::symmetric_eigen(normal.matrix / variance);
  const double floor = 1e-9 * values.maxCoeff();  // rounding
  const Eigen::ArrayXd d = values.array().max(floor);
  const Eigen::ArrayXd y = (vectors.transpose() * normal.right).array() / variance;
  const auto log_likelihood = [&](double before) {
    return 0.5 * (y.square() * before / (1 + before * d)).sum() - 0.5 * (1 + before * d).log().sum();
  };
  // s² from what the best seen force is known to, down to nothing, and up to all of the largest
  const double least = 1e-3 / d.maxCoeff(), most = 10 * (y / d).square().maxCoeff();
  double best = least;
  Known known;
  for (double before = least; before < most; before *= 1.2) {
    const double value = log_likelihood(before);
    if (!(value > known.log_likelihood)) continue;
    known.log_likelihood = value;
    best = before;
  }
  const Eigen::ArrayXd after = (d + 1 / best).inverse();
  known.mean = vectors * (after * y).matrix();
  known.covariance = vectors * after.matrix().asDiagonal() * vectors.transpose();
  return known;
}

/// The logarithm of how likely the data are without forces, as (14), for a known variance; up to a constant.
std::vector<double> log_likelihoods_of(const LambdaScan& scan) {
  std::vector<double> values = log_determinants_of(scan.points);
  for (std::size_t i = 0; i < values.size(); ++i) {
    const ScanPoint& p = scan.points[i];
    values[i] = -0.5 * (p.misfit + p.lambda * p.lambda * p.norm) / scan.variance - 0.5 * values[i];
  }
  return values;
}

/// From next to no background, which is quickly solved, to that of (9) by cross-validation, which explains the data
/// without any adhesion: until it gets less likely.
Known most_likely(const LatticeProblem& problem, const LambdaScan& scan, const MatrixXd& D, int threads) {
  const std::vector<double> without = log_likelihoods_of(scan);
  BesideBackground beside(problem, D, threads);
  Known best;
  double likeliest = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < scan.points.size(); ++i) {
    const double m = scan.points[i].lambda;
    if (m < scan.by_gcv && i > 0) break;
    Known known = known_from(beside.at(m), scan.variance);
    const double value = without[i] + known.log_likelihood;
    if (value < likeliest) break;
    likeliest = value;
    best = std::move(known);
  }
  return best;
}

}  // namespace

std::vector<AdhesionForce> forces_beside(const LatticeProblem& problem, const LambdaScan& scan,
                                         const std::vector<GroundPatch>& patches, const TractionInputs& inputs,
                                         const TractionParameters& parameters, int threads) {
  std::vector<AdhesionForce> forces = forces_by_adhesion(patches, inputs.adhesions, parameters.grow_um);
  if (forces.empty()) return forces;
  const MatrixXd D = problem.roots().asDiagonal() * even_forces_um_per_nN(inputs, parameters.gel_model, threads);
  const Known known = most_likely(problem, scan, D, threads);
  for (std::size_t a = 0; a < forces.size(); ++a) {
    const auto row = 2 * static_cast<Index>(a);
    forces[a].force_nN = {known.mean[row], known.mean[row + 1]};
    forces[a].sigma_nN = error_along(known.mean.segment<2>(row), known.covariance.block<2, 2>(row, row));
  }
  return forces;
}

namespace {
constexpr double kRounding = 1e-7;  // of a block: directions smaller than this are rounding
}

BesideBackground::BesideBackground(const LatticeProblem& problem, const MatrixXd& D, int threads)
    : problem_(problem), threads_(threads) {
  MatrixXd Y(D.rows(), D.cols() + 1);
  Y << D, problem.data();
  const VectorXd lengths = Y.colwise().norm();
  Y.array().rowwise() /= lengths.transpose().array();
  basis_ = numerics::principal_directions(Y, kRounding);
  start_ = numerics::transposed_product(basis_, Y, threads) * lengths.asDiagonal();
}

BesideBackground::Normal BesideBackground::at(double m) {
  constexpr double kEnough = 1e-5;  // of any number on the diagonal, by the next block if changes go on to fall alike
  MatrixXd found = product_at(m, 0);
  double change = 1;
  for (std::size_t n_blocks = 1;; ++n_blocks) {
    if (n_blocks > diagonal_.size()) add_block();
    const MatrixXd before = std::exchange(found, product_at(m, n_blocks));
    const double last =
        std::exchange(change, ((found - before).diagonal().array().abs() / found.diagonal().array()).maxCoeff());
    if (change * change <= kEnough * last || (is_complete() && n_blocks == diagonal_.size())) break;
  }
  const Index n = found.cols() - 1;
  return {.matrix = found.topLeftCorner(n, n), .right = found.col(n).head(n)};
}

MatrixXd BesideBackground::times_S(const MatrixXd& columns) const {
  constexpr int kEach = 16;  // columns that share their memory: fresh memory costs more than the transforms
  const int n = static_cast<int>(columns.cols());
  const WaveTransform& transform = problem_.transform();
  MatrixXd result(columns.rows(), n);
  numerics::parallel_for((n + kEach - 1) / kEach, threads_, [&](int part) {
    WaveField waves = transform.no_waves();
    NodeField nodes;
    for (int k = kEach * part; k < std::min(n, kEach * (part + 1)); ++k) {
      nodes = problem_.spread(columns.col(k), std::move(nodes));
      transform.forward(nodes, waves, 1);
      problem_.spectrum().displace(waves);
      problem_.spectrum().displace(waves);
      transform.backward(waves, nodes, 1);
      result.col(k) = problem_.at_beads(nodes);
    }
  });
  return result;
}

void BesideBackground::add_block() {
  MatrixXd next = times_S(basis_);
  if (!below_.empty()) next -= numerics::product(before_, below_.back().transpose(), threads_);
  const MatrixXd A = numerics::transposed_product(basis_, next, threads_);
  next -= numerics::product(basis_, A, threads_);
  diagonal_.push_back(0.5 * (A + A.transpose()));
  before_ = std::move(basis_);
  basis_ = numerics::principal_directions(next, kRounding);
  below_.push_back(numerics::transposed_product(basis_, next, threads_));
}

MatrixXd BesideBackground::product_at(double m, std::size_t n_blocks) const {
  const double share = 1 / (m * m);
  MatrixXd inner;  // B_jᵀ M_{j+1}⁻¹ B_j, at last Rᵀ M_1⁻¹ R
  if (n_blocks == 0) return numerics::gram(start_, threads_);
  for (std::size_t j = n_blocks; j-- > 0;) {
    MatrixXd M = share * diagonal_[j];
    M.diagonal().array() += 1;
    if (j + 1 < n_blocks) M -= share * share * inner;
    const bool is_definite = numerics::upper_cholesky(M, threads_);
    MBTFM_ASSERT(is_definite);
    MatrixXd solved = j > 0 ? below_[j - 1] : start_;
    numerics::solve_upper_transposed(M, solved, threads_);
    inner = numerics::gram(solved, threads_);
  }
  return inner;
}

}  // namespace mbtfm::tractions
