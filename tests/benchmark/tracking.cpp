#include <benchmark/benchmark.h>

#include <map>

#include "tests/support/bead_pair.h"

namespace {

using namespace mbtfm;

const test::BeadPair& pair_of(int width, int n_beads) {
  static std::map<std::pair<int, int>, test::BeadPair> pairs;
  if (!pairs.contains({width, n_beads})) {
    pairs[{width, n_beads}] = test::draw_bead_pair(test::ring_of_adhesions(width, 8.3),
                                                   {.width = width, .n_beads = n_beads, .drift = {1.7, -0.6}});
  }
  return pairs[{width, n_beads}];
}

void track(benchmark::State& state, int width, int n_beads) {
  const test::BeadPair& pair = pair_of(width, n_beads);
  for (auto _ : state) benchmark::DoNotOptimize(beads::track_beads(pair.relaxed, pair.stressed, 0.1, {}, 2));
}

/// The whole: 40 000 beads in 2048² px on two processors.
void pixels_and_beads(benchmark::State& state) {
  const int width = static_cast<int>(state.range(0));
  track(state, width, 40000 * width / 2048 * width / 2048);
  state.SetComplexityN(state.range(0) * state.range(0));
}
BENCHMARK(pixels_and_beads)->Arg(512)->Arg(1024)->Arg(2048)->Unit(benchmark::kMillisecond)->UseRealTime()->Complexity();

void beads(benchmark::State& state) {
  track(state, 1024, static_cast<int>(state.range(0)));
  state.SetComplexityN(state.range(0));
}
BENCHMARK(beads)->RangeMultiplier(2)->Range(2500, 20000)->Unit(benchmark::kMillisecond)->UseRealTime()->Complexity();

}  // namespace
