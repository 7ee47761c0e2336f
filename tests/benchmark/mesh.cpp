#include <benchmark/benchmark.h>

#include <cmath>

#include "network/mesh/mesh.h"
#include "tests/support/random_cell.h"

namespace {

using namespace mbtfm;

/// A cell for about so many vertices at an edge length of 1.5 um, its lines and adhesions in proportion to its area.
Cell cell_of(double n_vertices) {
  const double area_um2 = n_vertices * 0.5 * std::sqrt(3.0) * 1.5 * 1.5;
  const double radius_um = std::sqrt(area_um2 / 3.1416);
  return test::random_cell(1, {.radius_um = radius_um,
                               .n_adhesions = static_cast<int>(area_um2 / 25),
                               .n_fibres = static_cast<int>(std::sqrt(area_um2) / 3),
                               .n_outline_points = static_cast<int>(20 * radius_um)});
}

void mesh(benchmark::State& state, mesh::AdhesionAnchor anchor) {
  const Cell cell = cell_of(static_cast<double>(state.range(0)));
  mesh::NetworkParameters p;
  p.adhesion_anchor = anchor;
  std::size_t n_vertices = 0;
  for (auto _ : state) {
    const mesh::GeneratedNetwork generated = mesh::generate_network(cell, p);
    n_vertices = generated.network.vertices_um.size();
    state.counters["sweeps"] = generated.report.iterations;
    state.counters["mean_quality"] = generated.mean_quality;
  }
  state.counters["vertices"] = static_cast<double>(n_vertices);
  state.SetComplexityN(static_cast<benchmark::IterationCount>(n_vertices));
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  for (const int n : {1000, 3000, 10000, 30000, 100000}) benchmark->Arg(n);
  benchmark->Unit(benchmark::kMillisecond)->Complexity();
}
BENCHMARK_CAPTURE(mesh, ellipse, mesh::AdhesionAnchor::ellipse)->Apply(sizes);
BENCHMARK_CAPTURE(mesh, rim, mesh::AdhesionAnchor::rim)->Apply([](benchmark::internal::Benchmark* b) {
  for (const int n : {200, 600, 2000, 6000, 20000}) b->Arg(n);  // five times as many vertices
  b->Unit(benchmark::kMillisecond)->Complexity();
});

}  // namespace
