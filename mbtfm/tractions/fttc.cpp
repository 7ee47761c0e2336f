#include "mbtfm/tractions/fttc.h"

#include <cmath>
#include <numbers>

namespace mbtfm::tractions {

std::vector<double> lambdas_of(const LatticeProblem& problem) {
  // From tractions that only the longest waves of the field tell of, to those that its shortest waves tell of: beyond
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
        problem.data_squared() - 2 * solver.right_hand_side_times_solution() + solver.displaced_squared();
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
  if (problem.data_squared() == 0) return reconstruction_of_nothing(problem, inputs);
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
  double misfit = 0;
  for (const double d : problem.residuals(displacements)) misfit += d * d;
  r.relative_l2 = std::sqrt(misfit / problem.data_squared());
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

}  // namespace mbtfm::tractions
