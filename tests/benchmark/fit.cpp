/// Time of the tension fit, the compliance given: growth with vertices, beads and fibres; one mesh and eight.
/// CPU time of one thread where nothing else is said.
#include <benchmark/benchmark.h>

#include "samples/experiment/experiment.h"
#include "tests/support/tension_scene.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::tensions;
using test::TensionScene;

constexpr double kNoise = 0.07;  // as in experiments (thesis 3.3)

/// A simulated U2OS cell (170 adhesions) with so many fibres of up to 10 nN.
Cell cell_with(int n_fibres) {
  drawing::ScenarioParameters p;
  p.cell.fibre_spacing_um = 1;  // room for the many
  p.cell.n_ventral = n_fibres - 2 * (n_fibres / 3), p.cell.n_dorsal = p.cell.n_arc = n_fibres / 3;
  return drawing::draw_cell(p.cell, p.tension, drawing::field_um(p.microscope), 1).cell;
}

cables::CableNetwork network_of(const Cell& cell, double edge_um, std::uint64_t seed = 1) {
  mesh::NetworkParameters p;
  p.edge_length_um = edge_um;
  p.seed = seed;
  return cables::CableNetwork(mesh::generate_network(cell, p).network);
}

void fit_once(benchmark::State& state, const cables::CableNetwork& cables, const TensionScene& scene) {
  const tensions::TensionProblem problem(cables, scene.data.reduced, scene.adhesion_ids);
  int n_evaluations = 0;
  for (auto _ : state) {
    const tensions::TensionFit fit = tensions::fit_gauss_newton(problem, {}, tensions::uniform_start(problem));
    n_evaluations = fit.n_evaluations;
    if (!fit.report.converged) state.SkipWithError(fit.report.reason.c_str());
  }
  state.counters["equilibria"] = n_evaluations;
}

/// Ten times the edge length in, vertices out.
void vertices(benchmark::State& state) {
  const Cell cell = cell_with(20);
  const TensionScene scene = test::scene_of(cell, test::thesis_tensions_nN(cell.fibres.size(), 1), 2000, kNoise, 1);
  const cables::CableNetwork cables = network_of(cell, 0.1 * static_cast<double>(state.range(0)));
  const auto n = static_cast<benchmark::IterationCount>(cables.network().vertices_um.size());
  state.SetComplexityN(n);
  state.counters["vertices"] = static_cast<double>(n);
  fit_once(state, cables, scene);
}
BENCHMARK(vertices)->Arg(20)->Arg(17)->Arg(14)->Arg(12)->Arg(10)->Arg(9)->Unit(benchmark::kMillisecond)->Complexity();

/// From the beads on: reducing them is the only part that grows with their number.
void beads(benchmark::State& state) {
  const Cell cell = cell_with(20);
  const TensionScene scene = test::scene_of(cell, test::thesis_tensions_nN(cell.fibres.size(), 1),
                                            static_cast<int>(state.range(0)), kNoise, 1);
  for (auto _ : state) benchmark::DoNotOptimize(tensions::reduce(scene.beads, scene.compliance_um_per_nN));
  state.SetComplexityN(state.range(0));
}
BENCHMARK(beads)->RangeMultiplier(2)->Range(2500, 20000)->Unit(benchmark::kMillisecond)->Complexity();

void fibres(benchmark::State& state) {
  const Cell cell = cell_with(static_cast<int>(state.range(0)));
  const TensionScene scene = test::scene_of(cell, test::thesis_tensions_nN(cell.fibres.size(), 1), 2000, kNoise, 1);
  fit_once(state, scene.cables, scene);
  state.SetComplexityN(static_cast<benchmark::IterationCount>(cell.fibres.size()));
}
BENCHMARK(fibres)->Arg(5)->Arg(10)->Arg(20)->Arg(30)->Unit(benchmark::kMillisecond)->Complexity();

/// Everything behind the compliance, two threads, real time: 10 000 beads, default meshes.
void meshes(benchmark::State& state) {
  const Cell cell = cell_with(20);
  const TensionScene scene = test::scene_of(cell, test::thesis_tensions_nN(cell.fibres.size(), 1), 10000, kNoise, 1);
  std::vector<cables::CableNetwork> networks;
  for (int m = 0; m < state.range(0); ++m)
    networks.push_back(network_of(cell, mesh::NetworkParameters{}.edge_length_um, static_cast<std::uint64_t>(m) + 2));
  tensions::FitParameters parameters;
  parameters.n_meshes = static_cast<int>(state.range(0));
  for (auto _ : state) {
    tensions::LinearData data = tensions::reduce(scene.beads, scene.compliance_um_per_nN);
    benchmark::DoNotOptimize(tensions::fit_ensemble(networks, data, scene.adhesion_ids, parameters, 2));
  }
}
BENCHMARK(meshes)->Arg(1)->Arg(8)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
