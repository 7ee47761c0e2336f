/// A gel under a wave, as large as a scene of chapter 2 gets: its equations, their factor, a hundred right-hand
/// sides by it, and one without a factor.
#include <benchmark/benchmark.h>

#include <Eigen/IterativeLinearSolvers>
#include <Eigen/SparseCore>
#include <cmath>
#include <numeric>

#include "substrate/curved/linear.h"

namespace {

using namespace mbtfm;
using namespace mbtfm::curved;

const numerics::FactorOptions kFactor{.threads = 2, .memory_limit_GB = 16};
const Gel kGel{.youngs_modulus_kPa = 10, .poisson_ratio = 0.49, .thickness_um = 60};

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

struct Equations {
  int n_nodes;  ///< three unknowns each
  numerics::BlockMatrix<3> matrix;
};

Equations equations(const benchmark::State& state) {
  const Block block = wavy_block(static_cast<int>(state.range(0)), static_cast<int>(state.range(1)));
  const Space space(block.mesh(), kFactor.threads);
  return {space.nodes().size(), space.assemble(linear_stiffness_of(kGel, block.mesh()))};
}

void curved_equations(benchmark::State& state) {
  for (auto _ : state) state.counters["unknowns"] = 3 * equations(state).n_nodes;
}

void curved_factor(benchmark::State& state) {
  const Equations of = equations(state);
  for (auto _ : state) {
    const numerics::SparseCholesky factor(of.matrix, kFactor);
    state.counters["factor_GB"] = factor.factor_GB();
  }
}

void curved_solve(benchmark::State& state) {
  constexpr int kColumns = 100;
  const Equations of = equations(state);
  const numerics::SparseCholesky factor(of.matrix, kFactor);
  std::vector<int> all(static_cast<std::size_t>(of.n_nodes));
  std::iota(all.begin(), all.end(), 0);
  std::vector<double> found(kColumns);
  for (auto _ : state) {
    factor.solve(
        kColumns, all, [&](int column, const numerics::NodalColumn& b) { b(of.n_nodes / kColumns * column, 0) = 1; },
        [&](int column, const numerics::NodalColumn& u) { found[column] = u(0, 0); });
    benchmark::DoNotOptimize(found.data());
  }
}

/// One right-hand side by conjugate gradients, with the diagonal as preconditioner, as the thesis solves.
void curved_conjugate_gradients(benchmark::State& state) {
  const Equations of = equations(state);
  std::vector<Eigen::Triplet<double>> entries;
  for (int column = 0; column < of.matrix.n; ++column) {
    for (int k = of.matrix.start[column]; k < of.matrix.start[column + 1]; ++k) {
      for (int i = 0; i < 9; ++i)
        entries.emplace_back(3 * of.matrix.row[k] + i / 3, 3 * column + i % 3,
                             of.matrix.value[9 * static_cast<std::size_t>(k) + static_cast<std::size_t>(i)]);
    }
  }
  Eigen::SparseMatrix<double> lower(3 * of.n_nodes, 3 * of.n_nodes);
  lower.setFromTriplets(entries.begin(), entries.end());
  Eigen::ConjugateGradient<Eigen::SparseMatrix<double>, Eigen::Lower> solver(lower);
  solver.setTolerance(1e-6);
  const Eigen::VectorXd force = Eigen::VectorXd::Unit(3 * of.n_nodes, 3 * (of.n_nodes / 2));
  for (auto _ : state) benchmark::DoNotOptimize(solver.solve(force).eval().data());
  state.counters["unknowns"] = 3 * of.n_nodes;
  state.counters["iterations"] = static_cast<double>(solver.iterations());
}

BENCHMARK(curved_equations)->Args({18, 4})->Args({36, 8})->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(1);
BENCHMARK(curved_factor)->Args({18, 4})->Args({36, 8})->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(1);
BENCHMARK(curved_solve)->Args({18, 4})->Args({36, 8})->Unit(benchmark::kMillisecond)->UseRealTime()->Iterations(3);
BENCHMARK(curved_conjugate_gradients)->Args({27, 6})->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace
