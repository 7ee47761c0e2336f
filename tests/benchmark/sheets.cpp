/// Contracting sheets and a cell that presses into its gel, on one thread: the cases of docs/developers/sheets.md.
#include <benchmark/benchmark.h>

#include "continuum/sheet/forward.h"
#include "continuum/sheet/mesh_size.h"
#include "continuum/solids/indent.h"
#include "substrate/greens/models.h"
#include "tests/support/sheets.h"

namespace {

using namespace mbtfm;

const Gel kGel{.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = 60};

sheet::Scene disc(double radius_um) {
  sheet::Scene scene;
  scene.region.rims.emplace_back(test::circle(radius_um));
  scene.material = {1, 0.5, 4};
  scene.contraction.nN_per_um = 1;
  return scene;
}

std::unique_ptr<substrate::Substrate> layer() {
  substrate::SubstrateParameters parameters;
  parameters.model = substrate::ModelKind::layer;
  return greens::make_greens(kGel, parameters, 1);
}

/// R/l of 5.8: 12 700 nodes.
void sheet_on_springs(benchmark::State& state) {
  sheet::Scene scene = disc(25);
  scene.adhesion_nN_per_um3 = 0.288;
  scene.size = sheet::size_on_springs(scene.region, 4.3);
  for (auto _ : state) state.counters["nodes"] = sheet::solve_on_springs(scene, 1).elements->n_nodes();
}

/// Bonded, by all pairs of patches.
void sheet_on_gel(benchmark::State& state) {
  sheet::Scene scene = disc(25);
  const auto gel = layer();
  scene.size = {.at_curves_um = 25.0 / 50, .largest_um = 25.0 / 4, .growth = 0.9, .most_turn_rad = 0.35};
  for (auto _ : state) state.counters["patches"] = sheet::solve_on_gel(scene, *gel, 1).elements->n_triangles();
}

/// Bonded, by a lattice.
void colony_on_gel(benchmark::State& state) {
  sheet::Scene scene = disc(100);
  const auto gel = layer();
  scene.size = sheet::with_edge(sheet::size_on_gel(scene.region, scene.material, kGel, {}, gel->capabilities()), 0.9);
  for (auto _ : state) {
    const sheet::Solution solution = sheet::solve_on_gel(scene, *gel, 1);
    state.counters["nodes"] = solution.elements->n_nodes();
    state.counters["lattice"] = solution.gel_held == sheet::Held::lattice;
  }
}

/// 16 heights by 6 moduli, each on two meshes, and the best height of each.
void map_of_indentations(benchmark::State& state) {
  const solids::Setting setting{
      .volume_um3 = 5000, .cell = {10, 0.49, 30}, .slab = {60, 100}, .gel_poisson_ratio = 0.49};
  std::vector<solids::Case> cases;
  for (const double ratio : {0.1, 0.2, 0.5, 0.8, 1.0, 2.0})
    for (int k = 0; k < 16; ++k) cases.push_back({5.3 + 10.5 * k / 15, ratio});
  for (auto _ : state) {
    const auto solved = solids::indentations(setting, cases, 1, {});
    state.counters["optima"] = static_cast<double>(solids::optima(setting, solved, 1).size());
  }
}

BENCHMARK(sheet_on_springs)->Unit(benchmark::kMillisecond);
BENCHMARK(sheet_on_gel)->Unit(benchmark::kMillisecond);
BENCHMARK(colony_on_gel)->Unit(benchmark::kMillisecond);
BENCHMARK(map_of_indentations)->Unit(benchmark::kMillisecond)->Iterations(1);

}  // namespace
