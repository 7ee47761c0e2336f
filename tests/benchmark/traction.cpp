/// Times of traction reconstructions on the eight-ellipse scene.
#include <benchmark/benchmark.h>

#include "mbtfm/tractions/fttc.h"
#include "tests/support/ellipse_scene.h"

namespace mbtfm::tractions {
namespace {

void traction(benchmark::State& state, TractionMethod method) {
  const test::EllipseScene scene = test::ellipse_scene(static_cast<int>(state.range(0)), 0.05);
  TractionParameters parameters;
  parameters.method = method;
  parameters.gel_model = GelModel::half_space;
  TractionInputs inputs{.beads = scene.field, .gel = scene.gel, .adhesions = {}, .outline_um = {}};
  if (method == TractionMethod::adhesion_forces) inputs.adhesions = scene.adhesions;
  for (auto _ : state) benchmark::DoNotOptimize(reconstruct(inputs, parameters, 2));
}

BENCHMARK_CAPTURE(traction, fttc, TractionMethod::fttc)->Arg(128)->Arg(256)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(traction, sparse, TractionMethod::sparse)->Arg(128)->Unit(benchmark::kMillisecond);
BENCHMARK_CAPTURE(traction, adhesion_forces, TractionMethod::adhesion_forces)->Arg(128)->Unit(benchmark::kMillisecond);

}  // namespace
}  // namespace mbtfm::tractions
