/// Errors by point of a map, by drawing.
#include <cmath>
#include <random>

#include "mbtfm/tractions/fttc.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::tractions {

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
  TikhonovSolver of_noise(problem, problem.pulled_back(problem.spread_of(drawn_noise(problem, scan.variance, random))),
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
    TikhonovSolver solver(problem, problem.pulled_back(problem.spread_of(displacements)), 1);
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

}  // namespace mbtfm::tractions
