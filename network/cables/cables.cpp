#include "network/cables/cables.h"

#include <algorithm>
#include <limits>
#include <set>

#include "network/cables/cable_energy.h"
#include "network/cables/minimise.h"
#include "pipeline/contract/errors.h"
#include "pipeline/numerics/dense_panel.h"
#include "pipeline/numerics/parallel.h"
#include "pipeline/stage/help.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::cables {
namespace {

// A tension of zero means the limit t -> 0 from above: its cables are given this part of the largest tension. So
// slack directions have an equilibrium and derivatives; the forces change by less than 1e-7 of the largest.
constexpr double kSlackTension = 1e-7;
// A stretch is known to the rounding of two lengths, at a vertex of some six cables; its force to that part of EA.
constexpr double kStretchRounding = 8 * std::numeric_limits<double>::epsilon();
// A cable shorter than this times eps is collapsed: there the smoothing takes more than half a per cent off its force.
constexpr double kCollapsed = 10;

int index_of(const std::vector<int>& sorted, int value) {
  return static_cast<int>(std::lower_bound(sorted.begin(), sorted.end(), value) - sorted.begin());
}

/// The least tension over the largest, a zero one counted as what it means.
double weakest(const std::vector<double>& tensions_nN) {
  const auto [least, largest] = std::minmax_element(tensions_nN.begin(), tensions_nN.end());
  return *largest > 0 ? std::max(kSlackTension, *least / *largest) : 1;
}

double mean_rest_length_um(const Network& network) {
  double sum = 0;
  for (const Link& link : network.links) sum += link.rest_length_um;
  return sum / static_cast<double>(network.links.size());
}

FreeVertices free_vertices(const Network& network) {
  std::vector<int> unknown(network.vertices_um.size(), -1);
  int n_free = 0;
  for (std::size_t v = 0; v < unknown.size(); ++v)
    if (!is_held(network, v)) unknown[v] = n_free++;
  std::vector<int> pair(network.links.size(), -1);
  std::vector<std::array<int, 2>> pairs;
  for (std::size_t k = 0; k < pair.size(); ++k) {
    const int a = unknown[network.links[k].vertex_a], b = unknown[network.links[k].vertex_b];
    if (a < 0 || b < 0) continue;
    pair[k] = static_cast<int>(pairs.size());
    pairs.push_back({a, b});
  }
  return {std::move(unknown), std::move(pair), numerics::SpringMatrix(n_free, pairs)};
}

CableState state_of(const Cable& cable, const Pull& pull, Vec2 span_um, const Rounding& rounding) {
  if (norm(span_um) < kCollapsed * rounding.eps_um) return CableState::collapsed;
  return pull.stretch_um > kRestRounding * cable.rest_length_um ? CableState::taut : CableState::slack;
}

}  // namespace

void declare(stage::ParameterList& list, CableParameters& p) {
  list.table("cables");
  list.add("axial_stiffness_nN", p.axial_stiffness_nN, Range::force_nN());
  list.add("smoothing", p.smoothing, Range{.low = 1e-9, .high = 1e-2});
  list.add("force_tolerance", p.force_tolerance, Range{.low = 1e-13, .high = 1e-3});
  list.add("max_iterations", p.max_iterations, Range::between(1, 1e7),
           stage::help_on(
               "cables", "max_iterations",
               {std::to_string(CableParameters::kNewtonSteps), std::to_string(CableParameters::kConjugateSteps)}));
  list.add("contraction", p.contraction);
}

struct CableNetwork::Impl {
  Network network;
  CableParameters parameters;
  std::vector<int> fibre_ids, adhesion_ids;
  std::vector<int> group;     // by link
  std::vector<int> adhesion;  // by vertex: index of the adhesion that holds it, or −1: it is free or the cut holds it
  std::vector<int> held_vertices;
  double mean_rest_length_um = 0;
  FreeVertices free;

  Rounding rounding() const { return {.eps_um = parameters.smoothing * mean_rest_length_um, .mu_fJ = 0}; }
  std::vector<Cable> cables(const std::vector<double>& tensions_nN) const;
};

// What is given is checked here; from here on indices are in range, lengths positive, tensions not negative.
std::vector<Cable> CableNetwork::Impl::cables(const std::vector<double>& tensions_nN) const {
  if (tensions_nN.size() != fibre_ids.size())
    throw InvalidData("tensions", std::to_string(fibre_ids.size()) + " values", std::to_string(tensions_nN.size()));
  for (std::size_t g = 0; g < tensions_nN.size(); ++g)
    if (!(tensions_nN[g] >= 0 && std::isfinite(tensions_nN[g])))
      throw InvalidData("tension of fibre " + std::to_string(fibre_ids[g]), "a number >= 0 (nN)",
                        std::to_string(tensions_nN[g]));
  const double least = kSlackTension * *std::max_element(tensions_nN.begin(), tensions_nN.end());
  std::vector<Cable> result;
  result.reserve(network.links.size());
  for (std::size_t k = 0; k < network.links.size(); ++k) {
    const Link& link = network.links[k];
    result.push_back({.vertex_a = link.vertex_a,
                      .vertex_b = link.vertex_b,
                      .rest_length_um = link.rest_length_um,
                      .tension_nN = link.share * std::max(tensions_nN[group[k]], least),
                      .stiffness_nN_per_um = link.share * parameters.axial_stiffness_nN / link.rest_length_um});
  }
  return result;
}

CableNetwork::CableNetwork(Network network, CableParameters parameters) {
  check(network);
  std::set<int> fibres{0}, adhesions;
  for (const Link& link : network.links) fibres.insert(link.fibre_id);
  for (const int id : network.adhesion_id)
    if (id != 0) adhesions.insert(id);
  const bool is_cut = std::ranges::find(network.held_by_cut, true) != network.held_by_cut.end();
  if (adhesions.size() < (is_cut ? 1u : 2u))
    throw InvalidData("network",
                      is_cut ? "an adhesion that holds it, beside the cut"
                             : "at least two adhesions that hold it: with fewer it contracts to a point",
                      std::to_string(adhesions.size()));
  std::vector<int> fibre_ids(fibres.begin(), fibres.end()), adhesion_ids(adhesions.begin(), adhesions.end());
  std::vector<int> group, adhesion, held_vertices;
  for (const Link& link : network.links) group.push_back(index_of(fibre_ids, link.fibre_id));
  for (const int id : network.adhesion_id) adhesion.push_back(id == 0 ? -1 : index_of(adhesion_ids, id));
  for (std::size_t v = 0; v < adhesion.size(); ++v)
    if (is_held(network, v)) held_vertices.push_back(static_cast<int>(v));
  const double mean_rest = mean_rest_length_um(network);
  FreeVertices free = free_vertices(network);
  impl_ = std::make_shared<const Impl>(Impl{std::move(network), parameters, std::move(fibre_ids),
                                            std::move(adhesion_ids), std::move(group), std::move(adhesion),
                                            std::move(held_vertices), mean_rest, std::move(free)});
}

const Network& CableNetwork::network() const { return impl_->network; }
const CableParameters& CableNetwork::parameters() const { return impl_->parameters; }
const std::vector<int>& CableNetwork::fibre_ids() const { return impl_->fibre_ids; }
const std::vector<int>& CableNetwork::adhesion_ids() const { return impl_->adhesion_ids; }
bool CableNetwork::is_cut() const { return !impl_->network.held_by_cut.empty(); }
const std::vector<int>& CableNetwork::held_vertices() const { return impl_->held_vertices; }

Equilibrium CableNetwork::equilibrium(const std::vector<double>& tensions_nN, const std::vector<Vec2>& start,
                                      std::optional<double> force_tolerance) const {
  const std::vector<Cable> cables = impl_->cables(tensions_nN);
  std::vector<Vec2> positions = start.empty() ? impl_->network.vertices_um : start;
  if (positions.size() != impl_->network.vertices_um.size())
    throw InvalidData("start", std::to_string(impl_->network.vertices_um.size()) + " positions",
                      std::to_string(positions.size()));
  for (const int v : impl_->held_vertices) positions[v] = impl_->network.vertices_um[v];

  double force = 0, largest_share = 0;
  for (const Cable& cable : cables) force = std::max(force, cable.tension_nN);
  for (const Link& link : impl_->network.links) largest_share = std::max(largest_share, link.share);
  const double axial_stiffness = largest_share * impl_->parameters.axial_stiffness_nN;
  Minimum minimum = minimise(
      impl_->free, cables, std::move(positions), start.empty() ? Start::cold : Start::warm,
      {.method = impl_->parameters.contraction,
       .eps_um = impl_->rounding().eps_um,
       .edge_length_um = impl_->mean_rest_length_um,
       .force_nN = force > 0 ? force : axial_stiffness,
       .weakest = weakest(tensions_nN),
       .force_tolerance_nN = std::max(force_tolerance.value_or(impl_->parameters.force_tolerance) * force,
                                      kStretchRounding * axial_stiffness),
       .is_polished = !force_tolerance,
       .max_iterations = impl_->parameters.max_iterations.value_or(impl_->parameters.contraction == Contraction::newton
                                                                       ? CableParameters::kNewtonSteps
                                                                       : CableParameters::kConjugateSteps)});
  Equilibrium result;
  for (std::size_t k = 0; k < cables.size(); ++k) {
    const Pull p = pull(cables[k], minimum.spans_um[k], impl_->rounding());
    result.link_force_nN.push_back(p.force_nN * norm(minimum.spans_um[k]) / p.length_um);
    result.link_states.push_back(state_of(cables[k], p, minimum.spans_um[k], impl_->rounding()));
    result.energy_fJ += energy_fJ(cables[k], p, impl_->rounding());
  }
  result.positions_um = std::move(minimum.positions_um);
  result.spans_um = std::move(minimum.spans_um);
  result.report = std::move(minimum.report);
  return result;
}

std::vector<Vec2> CableNetwork::reactions_nN(const std::vector<double>& tensions_nN,
                                             const Equilibrium& equilibrium) const {
  const std::vector<Cable> cables = impl_->cables(tensions_nN);
  std::vector<Vec2> result(equilibrium.positions_um.size());
  for (std::size_t k = 0; k < cables.size(); ++k) {
    const Pull p = pull(cables[k], equilibrium.spans_um[k], impl_->rounding());
    const Vec2 force = (p.force_nN / p.length_um) * equilibrium.spans_um[k];
    result[cables[k].vertex_a] += force;
    result[cables[k].vertex_b] += -1.0 * force;
  }
  for (std::size_t v = 0; v < result.size(); ++v)
    if (impl_->free.unknown[v] >= 0) result[v] = {};
  return result;
}

Eigen::VectorXd CableNetwork::adhesion_forces_nN(const std::vector<double>& tensions_nN,
                                                 const Equilibrium& equilibrium) const {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(2 * static_cast<Eigen::Index>(impl_->adhesion_ids.size()));
  const std::vector<Vec2> reactions = reactions_nN(tensions_nN, equilibrium);
  for (std::size_t v = 0; v < reactions.size(); ++v) {
    const int i = impl_->adhesion[v];
    if (i >= 0) result.segment<2>(2 * i) += Eigen::Vector2d(reactions[v].x, reactions[v].y);
  }
  return result;
}

Eigen::VectorXd CableNetwork::network_part_nN(const Equilibrium& equilibrium) const {
  Eigen::VectorXd result = Eigen::VectorXd::Zero(2 * static_cast<Eigen::Index>(impl_->adhesion_ids.size()));
  const std::vector<Link>& links = impl_->network.links;
  for (std::size_t k = 0; k < links.size(); ++k) {
    const Vec2 span = equilibrium.spans_um[k];
    if (links[k].fibre_id != 0 || norm(span) == 0) continue;
    const Vec2 force = (equilibrium.link_force_nN[k] / norm(span)) * span;
    const int a = impl_->adhesion[links[k].vertex_a], b = impl_->adhesion[links[k].vertex_b];
    if (a >= 0) result.segment<2>(2 * a) += Eigen::Vector2d(force.x, force.y);
    if (b >= 0) result.segment<2>(2 * b) -= Eigen::Vector2d(force.x, force.y);
  }
  return result;
}

Eigen::MatrixXd CableNetwork::reaction_derivatives(const std::vector<double>& tensions_nN,
                                                   const Equilibrium& equilibrium, int threads) const {
  const std::vector<Cable> cables = impl_->cables(tensions_nN);
  const Eigen::Index n_groups = static_cast<Eigen::Index>(impl_->fibre_ids.size());
  numerics::SpringMatrix h_ff = impl_->free.matrix;
  h_ff.set_zero();
  numerics::SpringMatrix::Columns b_f = numerics::SpringMatrix::Columns::Zero(2 * h_ff.n_blocks(), n_groups);
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(2 * static_cast<Eigen::Index>(impl_->held_vertices.size()), n_groups);
  struct Coupling {
    int held, unknown;
    numerics::SpringMatrix::Block stiffness;
  };
  std::vector<Coupling> couplings;  // the blocks of −H_xf

  for (std::size_t k = 0; k < cables.size(); ++k) {
    const Pull p = pull(cables[k], equilibrium.spans_um[k], impl_->rounding());
    const Vec2 n = (1 / p.length_um) * equilibrium.spans_um[k];
    const numerics::SpringMatrix::Block block = stiffness(p, equilibrium.spans_um[k], p.stiffness_nN_per_um, n);
    impl_->free.add(h_ff, k, cables[k], block);
    const Eigen::Vector2d pull_of_unit_tension = impl_->network.links[k].share * Eigen::Vector2d(n.x, n.y);
    const int ends[2] = {cables[k].vertex_a, cables[k].vertex_b};
    for (int e = 0; e < 2; ++e) {
      const Eigen::Vector2d b = (e == 0 ? -1 : 1) * pull_of_unit_tension;
      const int unknown = impl_->free.unknown[ends[e]], other = impl_->free.unknown[ends[1 - e]];
      const int held = index_of(impl_->held_vertices, ends[e]);
      if (unknown >= 0)
        b_f.block<2, 1>(2 * unknown, impl_->group[k]) += b;
      else
        result.block<2, 1>(2 * held, impl_->group[k]) -= b;
      if (unknown < 0 && other >= 0) couplings.push_back({held, other, block});
    }
  }
  h_ff.factorise();
  // tensions in groups, each on its own
  constexpr Eigen::Index kGroup = 8 * numerics::kRightHandSides<double>;
  numerics::parallel_for(static_cast<int>((n_groups + kGroup - 1) / kGroup), threads, [&](int g) {
    const Eigen::Index first = g * kGroup, count = std::min(kGroup, n_groups - first);
    numerics::SpringMatrix::Columns moved = b_f.middleCols(first, count);
    h_ff.solve(moved);  // now −dx_f/dt
    for (const Coupling& c : couplings)
      result.block(2 * c.held, first, 2, count) -= c.stiffness * moved.middleRows<2>(2 * c.unknown);
  });
  return result;
}

Eigen::MatrixXd CableNetwork::adhesion_force_derivatives(const std::vector<double>& tensions_nN,
                                                         const Equilibrium& equilibrium, int threads) const {
  const Eigen::MatrixXd by_vertex = reaction_derivatives(tensions_nN, equilibrium, threads);
  Eigen::MatrixXd result =
      Eigen::MatrixXd::Zero(2 * static_cast<Eigen::Index>(impl_->adhesion_ids.size()), by_vertex.cols());
  for (std::size_t i = 0; i < impl_->held_vertices.size(); ++i) {
    const int adhesion = impl_->adhesion[impl_->held_vertices[i]];
    if (adhesion >= 0) result.middleRows<2>(2 * adhesion) += by_vertex.middleRows<2>(2 * static_cast<Eigen::Index>(i));
  }
  return result;
}

// With F = dU/dx and w the weights on the held vertices, the free ones following as they would such a displacement,
// w_f = −H_ff⁻¹ H_fx w_x: a change dF at fixed x lets the sum change by −wᵀ dF. One solve serves every part of the
// scene.
GeometryGradient CableNetwork::geometry_gradient(const std::vector<double>& tensions_nN, const Equilibrium& equilibrium,
                                                 const Eigen::MatrixXd& weights) const {
  const std::vector<Cable> cables = impl_->cables(tensions_nN);
  numerics::SpringMatrix h_ff = impl_->free.matrix;
  h_ff.set_zero();
  numerics::SpringMatrix::Columns w_f = numerics::SpringMatrix::Columns::Zero(2 * h_ff.n_blocks(), weights.cols());
  for (std::size_t k = 0; k < cables.size(); ++k) {
    const Pull p = pull(cables[k], equilibrium.spans_um[k], impl_->rounding());
    const Vec2 n = (1 / p.length_um) * equilibrium.spans_um[k];
    const numerics::SpringMatrix::Block block = stiffness(p, equilibrium.spans_um[k], p.stiffness_nN_per_um, n);
    impl_->free.add(h_ff, k, cables[k], block);
    const int ends[2] = {cables[k].vertex_a, cables[k].vertex_b};
    for (int e = 0; e < 2; ++e) {
      const int unknown = impl_->free.unknown[ends[e]], adhesion = impl_->adhesion[ends[1 - e]];
      if (unknown >= 0 && adhesion >= 0) w_f.middleRows<2>(2 * unknown) += block * weights.middleRows<2>(2 * adhesion);
    }
  }
  h_ff.factorise();
  h_ff.solve(w_f);

  const auto rows_of = [&](int v) -> Eigen::MatrixXd {
    if (impl_->adhesion[v] >= 0) return weights.middleRows<2>(2 * impl_->adhesion[v]);
    if (impl_->free.unknown[v] >= 0) return w_f.middleRows<2>(2 * impl_->free.unknown[v]);
    return Eigen::MatrixXd::Zero(2, weights.cols());  // no sum counts the cut's forces
  };
  GeometryGradient gradient{
      Eigen::MatrixXd::Zero(2 * static_cast<Eigen::Index>(impl_->held_vertices.size()), weights.cols()),
      Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(cables.size()), weights.cols())};
  for (std::size_t k = 0; k < cables.size(); ++k) {
    const Pull p = pull(cables[k], equilibrium.spans_um[k], impl_->rounding());
    const Vec2 n = (1 / p.length_um) * equilibrium.spans_um[k];
    const Eigen::MatrixXd apart = rows_of(cables[k].vertex_b) - rows_of(cables[k].vertex_a);
    gradient.by_link.row(static_cast<Eigen::Index>(k)) = -Eigen::RowVector2d(n.x, n.y) * apart;
    // A new mesh takes its rest lengths from the new places: the cable turns, but keeps its force.
    const Eigen::MatrixXd turned = stiffness(p, equilibrium.spans_um[k], 0, n) * apart;
    const int ends[2] = {cables[k].vertex_a, cables[k].vertex_b};
    for (int e = 0; e < 2; ++e) {
      if (impl_->free.unknown[ends[e]] >= 0) continue;
      gradient.by_held_vertex.middleRows<2>(2 * index_of(impl_->held_vertices, ends[e])) += (e == 0 ? 1 : -1) * turned;
    }
  }
  return gradient;
}

// Of a sheet of links that carry share · t: half the trace of its stress, sigma = t / (2 A) sum share_k l_k. On a
// regular triangulation of edge h this is sqrt(3) t / h (docs/theory/network.md, (4)).
double surface_tension_nN_per_um(const Network& network, const Polygon& outline_um, double tension_nN) {
  double sum_um = 0;
  for (const Link& link : network.links)
    if (link.fibre_id == 0) sum_um += link.share * link.rest_length_um;
  return tension_nN * sum_um / (2 * std::abs(signed_area_um2(outline_um)));
}

}  // namespace mbtfm::cables
