// Growth with the vertices of one cell's mesh: 1 200, 5 000, 20 000 and 100 000. CPU time of one thread.
#include <benchmark/benchmark.h>
#include <cholmod.h>

#include <map>

#include "network/cables/cables.h"
#include "network/mesh/mesh.h"
#include "pipeline/numerics/spring_matrix.h"
#include "tests/support/lattice.h"
#include "tests/support/random_cell.h"

namespace {

using namespace mbtfm;
using cables::CableNetwork;
using cables::CableParameters;
using cables::Equilibrium;
using numerics::SpringMatrix;

/// A cell of 2 000 um² with 19 fibres on a mesh of about so many vertices. The network's links keep its surface tension
/// and stiffness: 0.06 nN and 50 nN at an edge of 1.5 um.
Network make_mesh(int n_vertices) {
  const Cell cell = test::random_cell(4, {.radius_um = 27, .n_adhesions = 60, .n_fibres = 19, .least_distance_um = 2});
  const double edge_um = std::sqrt(std::abs(signed_area_um2(cell.outline_um)) / (std::sqrt(0.75) * n_vertices));
  Network result = mesh::generate_network(cell, {.edge_length_um = edge_um}).network;
  for (Link& link : result.links)
    if (link.fibre_id == 0) link.share *= edge_um / 1.5;
  return result;
}

const Network& mesh(int n_vertices) {
  static std::map<int, Network> made;
  if (!made.contains(n_vertices)) made[n_vertices] = make_mesh(n_vertices);
  return made[n_vertices];
}

struct Scene {
  explicit Scene(const benchmark::State& state, cables::CableParameters parameters = {})
      : cables(mesh(static_cast<int>(state.range(0))), parameters),
        tensions(test::random_tensions_nN(cables.fibre_ids().size(), 1)) {}
  cables::CableNetwork cables;
  std::vector<double> tensions;
};

void record(benchmark::State& state, const cables::Equilibrium& equilibrium) {
  state.counters["steps"] = equilibrium.report.iterations;
  state.counters["vertices"] = static_cast<double>(equilibrium.positions_um.size());
  if (!equilibrium.report.converged) state.SkipWithError(equilibrium.report.reason.c_str());
}

void analyse(benchmark::State& state) {
  const Network& network = mesh(static_cast<int>(state.range(0)));
  for (auto _ : state) benchmark::DoNotOptimize(cables::CableNetwork(network));
}

void cold(benchmark::State& state) {
  const Scene scene(state);
  cables::Equilibrium equilibrium;
  for (auto _ : state) equilibrium = scene.cables.equilibrium(scene.tensions);
  record(state, equilibrium);
}

void warm_after_5_per_cent(benchmark::State& state) {
  const Scene scene(state);
  const cables::Equilibrium before = scene.cables.equilibrium(scene.tensions);
  std::vector<double> changed = scene.tensions;
  for (std::size_t g = 0; g < changed.size(); ++g) changed[g] *= g % 2 == 0 ? 1.05 : 0.95;
  cables::Equilibrium equilibrium;
  for (auto _ : state) equilibrium = scene.cables.equilibrium(changed, before.positions_um);
  record(state, equilibrium);
}

void derivatives_of_20_groups(benchmark::State& state) {
  const Scene scene(state);
  const cables::Equilibrium equilibrium = scene.cables.equilibrium(scene.tensions);
  for (auto _ : state) benchmark::DoNotOptimize(scene.cables.adhesion_force_derivatives(scene.tensions, equilibrium));
  record(state, equilibrium);
}

/// The thesis' method, to the same residual.
void cold_by_conjugate_gradients(benchmark::State& state) {
  const Scene scene(state, {.contraction = cables::Contraction::conjugate_gradient});
  cables::Equilibrium equilibrium;
  for (auto _ : state) equilibrium = scene.cables.equilibrium(scene.tensions);
  record(state, equilibrium);
}

void sizes(benchmark::internal::Benchmark* benchmark) {
  for (const int n_vertices : {1200, 5000, 20000, 100000}) benchmark->Arg(n_vertices);
  benchmark->Unit(benchmark::kMillisecond);
}
BENCHMARK(analyse)->Apply(sizes);
BENCHMARK(cold)->Apply(sizes);
BENCHMARK(warm_after_5_per_cent)->Apply(sizes);
BENCHMARK(derivatives_of_20_groups)->Apply(sizes);
BENCHMARK(cold_by_conjugate_gradients)->Arg(1200)->Iterations(1)->Unit(benchmark::kMillisecond);

// Why the factorisation is our own: the same matrix, springs of a mesh on a weak ground, by CHOLMOD.

std::vector<std::array<int, 2>> pairs_of(const Network& network) {
  std::vector<std::array<int, 2>> pairs;
  for (const Link& link : network.links) pairs.push_back({link.vertex_a, link.vertex_b});
  return pairs;
}

void factorise(benchmark::State& state) {
  const Network& net = mesh(static_cast<int>(state.range(0)));
  const auto pairs = pairs_of(net);
  numerics::SpringMatrix matrix(static_cast<int>(net.vertices_um.size()), pairs);
  matrix.set_zero();
  for (std::size_t k = 0; k < pairs.size(); ++k)
    matrix.add_spring(static_cast<int>(k), numerics::SpringMatrix::Block::Identity());
  for (int i = 0; i < matrix.n_blocks(); ++i) matrix.add_diagonal(i, 0.01 * numerics::SpringMatrix::Block::Identity());
  for (auto _ : state) matrix.factorise();
}

void factorise_by_cholmod(benchmark::State& state) {
  const Network& net = mesh(static_cast<int>(state.range(0)));
  cholmod_common common;
  cholmod_start(&common);
  const std::size_t n = 2 * net.vertices_um.size();
  // Lower triangle; duplicate entries add up. Cross terms of zero keep the blocks full.
  cholmod_triplet* list = cholmod_allocate_triplet(n, n, 3 * n + 10 * net.links.size(), -1, CHOLMOD_REAL, &common);
  const auto add = [&](int row, int column, double value) {
    static_cast<int*>(list->i)[list->nnz] = row;
    static_cast<int*>(list->j)[list->nnz] = column;
    static_cast<double*>(list->x)[list->nnz++] = value;
  };
  for (int i = 0; i < static_cast<int>(n); ++i) add(i, i, 0.01);
  for (int i = 0; i < static_cast<int>(n); i += 2) add(i + 1, i, 0);
  for (const Link& link : net.links) {
    const int low = 2 * std::min(link.vertex_a, link.vertex_b), high = 2 * std::max(link.vertex_a, link.vertex_b);
    for (int c = 0; c < 2; ++c) {
      add(low + c, low + c, 1);
      add(high + c, high + c, 1);
      add(high + c, low + c, -1);
      add(high + c, low + 1 - c, 0);
    }
  }
  cholmod_sparse* matrix = cholmod_triplet_to_sparse(list, 0, &common);
  common.nmethods = 1;
  common.method[0].ordering = state.range(1) == CHOLMOD_SIMPLICIAL ? CHOLMOD_AMD : CHOLMOD_NESDIS;
  common.supernodal = static_cast<int>(state.range(1));
  cholmod_factor* factor = cholmod_analyze(matrix, &common);
  for (auto _ : state) cholmod_factorize(matrix, factor, &common);
  cholmod_free_factor(&factor, &common);
  cholmod_free_sparse(&matrix, &common);
  cholmod_free_triplet(&list, &common);
  cholmod_finish(&common);
}

BENCHMARK(factorise)->Apply(sizes);
BENCHMARK(factorise_by_cholmod)
    ->ArgNames({"", "supernodal"})
    ->ArgsProduct({{1200, 5000, 20000, 100000}, {CHOLMOD_SIMPLICIAL, CHOLMOD_SUPERNODAL}})
    ->Unit(benchmark::kMillisecond);

}  // namespace
