/// Time of each model's matrix against adhesions and beads.
#include <benchmark/benchmark.h>

#include "substrate/choice/factory.h"
#include "tests/support/substrate_scene.h"

namespace {

using namespace mbtfm;

void matrix(benchmark::State& state, const char* model, double thickness_um) {
  const auto points = test::scattered_points(static_cast<int>(state.range(1)), 45);
  const auto ellipses = test::scattered_ellipses(static_cast<int>(state.range(0)), 35);
  const Gel gel = {.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = thickness_um};
  for (auto _ : state) {
    const auto substrate = choice::make_substrate(gel, test::model_named(model), 2);
    benchmark::DoNotOptimize(substrate->compliance_um_per_nN(points, ellipses).data());
  }
}

BENCHMARK_CAPTURE(matrix, half_space, "half-space", 30)
    ->Args({170, 10000})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(matrix, layer_30, "layer", 30)
    ->Args({17, 10000})
    ->Args({170, 1000})
    ->Args({170, 10000})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(matrix, layer_60, "layer", 60)->Args({170, 10000})->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(matrix, split_30, "split", 30)
    ->Args({17, 10000})
    ->Args({170, 10000})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime();
BENCHMARK_CAPTURE(matrix, split_60, "split", 60)->Args({170, 10000})->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(matrix, refined_30, "refined", 30)
    ->Args({1, 1000})
    ->Args({17, 10000})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->Iterations(1);

}  // namespace
