/// Time of the tension fit, the compliance given: growth with vertices, beads and fibres; one mesh and eight; and
/// against the thesis' way to the same misfit. CPU time of one thread where nothing else is said.
#include <benchmark/benchmark.h>

#include <atomic>
#include <ctime>
#include <map>

#include "mbtfm/solved_misfit.h"
#include "samples/experiment.h"
#include "tests/support/tension_scene.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::inverse;
using test::TensionScene;

constexpr double kNoise = 0.07;  // as in experiments (thesis 3.3)

/// A simulated U2OS cell (170 adhesions) with so many fibres of up to 10 nN.
Cell cell_with(int n_fibres) {
  samples::ScenarioParameters p;
  p.cell.fibre_spacing_um = 1;  // room for the many
  p.cell.n_ventral = n_fibres - 2 * (n_fibres / 3), p.cell.n_dorsal = p.cell.n_arc = n_fibres / 3;
  return samples::draw_cell(p.cell, p.tension, samples::field_um(p.microscope), 1).cell;
}

Eigen::VectorXd tensions_nN(const Cell& cell) {
  std::mt19937_64 random(1);
  Eigen::VectorXd tensions(static_cast<Eigen::Index>(cell.fibres.size()) + 1);
  tensions[0] = 0.06;
  for (Eigen::Index i = 1; i < tensions.size(); ++i) tensions[i] = 10 * std::generate_canonical<double, 53>(random);
  return tensions;
}

network::CableNetwork network_of(const Cell& cell, double edge_um, std::uint64_t seed = 1) {
  network::NetworkParameters p;
  p.edge_length_um = edge_um;
  p.seed = seed;
  return network::CableNetwork(network::generate_network(cell, p).network);
}

void fit_once(benchmark::State& state, const network::CableNetwork& cables, const TensionScene& scene) {
  const TensionProblem problem(cables, scene.data.reduced, scene.adhesion_ids);
  int n_evaluations = 0;
  for (auto _ : state) {
    const TensionFit fit = fit_gauss_newton(problem, {}, uniform_start_nN(problem));
    n_evaluations = fit.n_evaluations;
    if (!fit.report.converged) state.SkipWithError(fit.report.reason.c_str());
  }
  state.counters["equilibria"] = n_evaluations;
}

/// Ten times the edge length in, vertices out.
void vertices(benchmark::State& state) {
  const Cell cell = cell_with(20);
  const TensionScene scene = test::scene_of(cell, tensions_nN(cell), 2000, kNoise, 1);
  const network::CableNetwork cables = network_of(cell, 0.1 * static_cast<double>(state.range(0)));
  const auto n = static_cast<benchmark::IterationCount>(cables.network().vertices_um.size());
  state.SetComplexityN(n);
  state.counters["vertices"] = static_cast<double>(n);
  fit_once(state, cables, scene);
}
BENCHMARK(vertices)->Arg(20)->Arg(17)->Arg(14)->Arg(12)->Arg(10)->Unit(benchmark::kMillisecond)->Complexity();

/// From the beads on: reducing them is the only part that grows with their number.
void beads(benchmark::State& state) {
  const Cell cell = cell_with(20);
  const TensionScene scene = test::scene_of(cell, tensions_nN(cell), static_cast<int>(state.range(0)), kNoise, 1);
  for (auto _ : state) benchmark::DoNotOptimize(reduce(scene.beads, scene.compliance_um_per_nN));
  state.SetComplexityN(state.range(0));
}
BENCHMARK(beads)->RangeMultiplier(2)->Range(2500, 20000)->Unit(benchmark::kMillisecond)->Complexity();

void fibres(benchmark::State& state) {
  const Cell cell = cell_with(static_cast<int>(state.range(0)));
  const TensionScene scene = test::scene_of(cell, tensions_nN(cell), 2000, kNoise, 1);
  fit_once(state, scene.cables, scene);
  state.SetComplexityN(static_cast<benchmark::IterationCount>(cell.fibres.size()));
}
BENCHMARK(fibres)->Arg(5)->Arg(10)->Arg(20)->Arg(30)->Unit(benchmark::kMillisecond)->Complexity();

/// Everything behind the compliance, two threads, real time: 10 000 beads, default meshes.
void meshes(benchmark::State& state) {
  const Cell cell = cell_with(20);
  const TensionScene scene = test::scene_of(cell, tensions_nN(cell), 10000, kNoise, 1);
  std::vector<network::CableNetwork> networks;
  for (int m = 0; m < state.range(0); ++m)
    networks.push_back(
        network_of(cell, network::NetworkParameters{}.edge_length_um, static_cast<std::uint64_t>(m) + 2));
  FitParameters parameters;
  parameters.n_meshes = static_cast<int>(state.range(0));
  for (auto _ : state) {
    LinearData data = reduce(scene.beads, scene.compliance_um_per_nN);
    benchmark::DoNotOptimize(fit_ensemble(networks, data, scene.adhesion_ids, parameters, 2, {}));
  }
}
BENCHMARK(meshes)->Arg(1)->Arg(8)->Unit(benchmark::kMillisecond)->UseRealTime();

/// Ends a minimisation that knows no such end.
struct Reached {};

double seconds_since(std::clock_t begin) { return static_cast<double>(std::clock() - begin) / CLOCKS_PER_SEC; }

/// Both ways from the same start on the same beads and mesh, measured from begin to end in processor time of one
/// thread: block-wise conjugate gradients with finite differences, the gel solved in each evaluation, until a trial is
/// within one standard error of Gauss–Newton's minimum (2 Phi above it by one variance). Our time includes the
/// compliance and the reduction of the beads; `ratio_compliance_given` leaves out the former. The gel's factor is kept
/// between evaluations, as the thesis did not: the ratio is the smaller for it. So that the thesis' way ends within
/// minutes the cells are small: a ring of two adhesions for each fibre, 80 beads for each. The ratio grows with the
/// cell.
void thesis_way(benchmark::State& state) {
  const auto n_fibres = static_cast<int>(state.range(0));
  Cell cell = test::round_cell(2.0 * n_fibres, 2 * n_fibres);
  for (int i = 1; i <= n_fibres; ++i) test::add_ventral(cell, i, i + n_fibres - i % 2);
  const Eigen::VectorXd truth = tensions_nN(cell);
  const TensionScene scene = test::scene_of(cell, truth, 80 * n_fibres, kNoise, 1);
  const auto gel = substrate::make_substrate({.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = 60},
                                             {.model = "split"}, 1);
  for (auto _ : state) {
    std::clock_t begin = std::clock();
    const LinearData data = reduce(scene.beads, gel->compliance_um_per_nN(scene.points_um, scene.ellipses));
    const double compliance_s = seconds_since(begin);
    const TensionProblem problem(scene.cables, data.reduced, scene.adhesion_ids);
    const Eigen::VectorXd start = Eigen::VectorXd::Constant(truth.size(), 0.06);  // thesis: all at the network's
    const TensionFit ours = fit_gauss_newton(problem, {}, start);
    const double ours_s = seconds_since(begin);

    const double target = 2 * ours.trial.objective + data.reduced.floor_squared + 1;
    std::atomic<int> n_evaluations = 0;
    double least = 1e300;
    const SolvedMisfit solved = solved_misfit(*gel, scene.points_um, scene.ellipses, data);
    const SolvedMisfit until_reached = [&](const Eigen::VectorXd& forces_nN) {
      ++n_evaluations;
      const double misfit = solved(forces_nN);
      least = std::min(least, misfit);  // one thread
      if (misfit <= target) throw Reached();
      return misfit;
    };
    FitParameters parameters;
    parameters.method = "blockwise-cg";
    parameters.gradients = "finite-difference";
    parameters.max_evaluations = 1000000;
    parameters.tolerance = 1e-300;  // its steps are short long before the minimum
    const TensionProblem by_solution(scene.cables, data.reduced, scene.adhesion_ids, until_reached);
    begin = std::clock();
    try {
      fit_tensions(by_solution, parameters, 1, start);
      const std::string how_far = "the thesis' way stopped " + std::to_string(least - target) +
                                  " above the misfit after " + std::to_string(n_evaluations) + " evaluations";
      state.SkipWithError(how_far.c_str());
    } catch (const Reached&) {
    }
    const double thesis_s = seconds_since(begin);
    state.SetIterationTime(ours_s);
    state.counters["compliance_s"] = compliance_s;
    state.counters["ours_s"] = ours_s;
    state.counters["our_equilibria"] = ours.n_evaluations;
    state.counters["thesis_s"] = thesis_s;
    state.counters["thesis_evaluations"] = n_evaluations.load();
    state.counters["ratio"] = thesis_s / ours_s;
    state.counters["ratio_compliance_given"] = thesis_s / (ours_s - compliance_s);
  }
}
BENCHMARK(thesis_way)->Arg(6)->Arg(10)->Iterations(1)->UseManualTime()->Unit(benchmark::kMillisecond);

}  // namespace
