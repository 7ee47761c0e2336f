#include <benchmark/benchmark.h>

#include "tests/support/find_fibres.h"
#include "tests/support/segmentation_accuracy.h"

namespace {

using namespace mbtfm;

/// Simulated cells of the same size in fields of this many pixels a side, or (2048) four in one field.
const test::SimulatedCell& cell_of(int side_px) {
  static std::map<int, test::SimulatedCell> cells;
  if (!cells.contains(side_px)) {
    const test::SimulatedCell one = test::simulated_cell("u2os", "ordinary", 1);
    test::SimulatedCell tiled = one;
    const int side = one.actin.image.width;
    for (auto [from, to] :
         {std::pair(&one.adhesion.image, &tiled.adhesion.image), {&one.actin.image, &tiled.actin.image}}) {
      to->width = to->height = side_px;
      to->pixels.resize(static_cast<std::size_t>(side_px) * side_px);
      for (int row = 0; row < side_px; ++row)
        for (int column = 0; column < side_px; ++column) to->at(column, row) = from->at(column % side, row % side);
    }
    cells[side_px] = tiled;
  }
  return cells[side_px];
}

void adhesions(benchmark::State& state) {
  const auto& cell = cell_of(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(cells::find_adhesions(cell.adhesion.image, 0.1, {}));
  state.SetComplexityN(state.range(0) * state.range(0));
}

void outline(benchmark::State& state) {
  const auto& cell = cell_of(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(cells::find_cells(cell.actin.image, {}, 0.1, {}));
  state.SetComplexityN(state.range(0) * state.range(0));
}

void fibres(benchmark::State& state) {
  const auto& cell = cell_of(static_cast<int>(state.range(0)));
  const auto found = cells::find_adhesions(cell.adhesion.image, 0.1, {});
  for (auto _ : state) benchmark::DoNotOptimize(cells::find_fibres(cell.actin.image, {}, found, 0.1, {}));
  state.SetComplexityN(state.range(0) * state.range(0));
}

void sizes(benchmark::internal::Benchmark* b) {
  for (const int side : {512, 1024, 2048}) b->Arg(side);
  b->Unit(benchmark::kMillisecond)->UseRealTime()->Complexity();
}
BENCHMARK(adhesions)->Apply(sizes);
BENCHMARK(outline)->Apply(sizes);
BENCHMARK(fibres)->Apply(sizes);

}  // namespace
