#include <benchmark/benchmark.h>

#include "network/cables.h"
#include "tests/support/lattice.h"

namespace {

using namespace mbtfm;
using network::CableNetwork;
using network::Equilibrium;

struct Scene {
  explicit Scene(int columns)
      : cables(test::lattice({.columns = columns, .rows = columns, .n_fibres = 20, .seed = 1})),
        tensions(test::random_tensions_nN(cables.fibre_ids().size(), 1)) {}
  CableNetwork cables;
  std::vector<double> tensions;
};

void cold(benchmark::State& state) {
  const Scene scene(static_cast<int>(state.range(0)));
  for (auto _ : state) {
    const Equilibrium equilibrium = scene.cables.equilibrium(scene.tensions);
    state.counters["steps"] = equilibrium.report.iterations;
  }
  state.SetComplexityN(state.range(0) * state.range(0));
}

void warm_after_5_per_cent(benchmark::State& state) {
  const Scene scene(static_cast<int>(state.range(0)));
  const Equilibrium before = scene.cables.equilibrium(scene.tensions);
  std::vector<double> changed = scene.tensions;
  for (std::size_t g = 0; g < changed.size(); ++g) changed[g] *= g % 2 == 0 ? 1.05 : 0.95;
  for (auto _ : state) {
    const Equilibrium equilibrium = scene.cables.equilibrium(changed, before.positions_um);
    state.counters["steps"] = equilibrium.report.iterations;
  }
  state.SetComplexityN(state.range(0) * state.range(0));
}

void derivatives_of_20_groups(benchmark::State& state) {
  const Scene scene(static_cast<int>(state.range(0)));
  const Equilibrium equilibrium = scene.cables.equilibrium(scene.tensions);
  for (auto _ : state) benchmark::DoNotOptimize(scene.cables.adhesion_force_derivatives(scene.tensions, equilibrium));
  state.SetComplexityN(state.range(0) * state.range(0));
}

// Columns of a square lattice: 289, 1 225, 4 900, 10 000 vertices.
void sizes(benchmark::internal::Benchmark* benchmark) {
  for (const int columns : {17, 35, 70, 100}) benchmark->Arg(columns);
  benchmark->Unit(benchmark::kMillisecond)->Complexity();
}
BENCHMARK(cold)->Apply(sizes);
BENCHMARK(warm_after_5_per_cent)->Apply(sizes);
BENCHMARK(derivatives_of_20_groups)->Apply(sizes);

}  // namespace
