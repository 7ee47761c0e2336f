/// A gel under a wave, as large as a scene of chapter 2 gets: its factor, and a hundred right-hand sides by it.
#include <benchmark/benchmark.h>

#include <cmath>
#include <numeric>

#include "substrate/curved/linear.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::curved;

constexpr numerics::FactorOptions kFactor{.threads = 2, .memory_limit_GB = 16};
constexpr Gel kGel{.youngs_modulus_kPa = 10, .poisson_ratio = 0.49, .thickness_um = 60};

/// 120 um wide, free at its sides, of n × n × layers cells.
Block wavy_block(int n, int layers) {
  boxes::GridLines lines;
  for (int k = 0; k <= n; ++k) lines.x_um.push_back(-60 + 120.0 * k / n);
  lines.y_um = lines.x_um;
  lines.z_um = layers_um(kGel.thickness_um, layers);
  return {{[](Vec2 p) { return -8 * std::cos(0.09 * p.x); }, kGel.thickness_um},
          lines,
          [](const boxes::Box&) { return false; },
          Sides::free,
          100000,
          kFactor.threads};
}

numerics::SparseCholesky factor_of(const Block& block) {
  const Space space(block.mesh(), kFactor.threads);
  return {space.assemble(linear_stiffness_of(kGel, block.mesh())), kFactor};
}

/// Of the mesh: a third of them.
int n_free_nodes(const Block& block) {
  const auto& held = block.mesh().is_held;
  return static_cast<int>(held.size()) - std::accumulate(held.begin(), held.end(), 0);
}

void curved_factor(benchmark::State& state) {
  const Block block = wavy_block(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  for (auto _ : state) state.counters["factor_GB"] = factor_of(block).factor_GB();
  state.counters["unknowns"] = 3 * n_free_nodes(block);
}

void curved_solve(benchmark::State& state) {
  constexpr int kColumns = 100;
  const Block block = wavy_block(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  const numerics::SparseCholesky factor = factor_of(block);
  std::vector<int> nodes;
  for (int node = 0; node < std::ssize(block.mesh().is_held); ++node) {
    if (!block.mesh().is_held[node]) nodes.push_back(node);
  }
  std::vector<double> found(kColumns);
  for (auto _ : state) {
    factor.solve(
        kColumns, nodes,
        [&](int column, const numerics::NodalColumn& b) { b(nodes[nodes.size() * column / kColumns], 0) = 1; },
        [&](int column, const numerics::NodalColumn& u) { found[column] = u(nodes.front(), 0); });
    benchmark::DoNotOptimize(found.data());
  }
}

BENCHMARK(curved_factor)->Args({18, 4})->Args({36, 8})->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(1);
BENCHMARK(curved_solve)->Args({18, 4})->Args({36, 8})->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(3);

}  // namespace
