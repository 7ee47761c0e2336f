#include "mbtfm/fit/networks.h"

#include <algorithm>
#include <map>

#include "network/cables/effects.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/parallel.h"

namespace mbtfm::fit {

using namespace tensions;

namespace {

VectorXd tensions_of_groups(const std::vector<int>& fibre_ids, const std::vector<Tension>& before) {
  std::map<int, double> known;
  double sum = 0;
  for (const Tension& t : before) {
    known[t.fibre_id] = t.tension_nN;
    sum += t.tension_nN;
  }
  VectorXd tensions_nN(static_cast<Index>(fibre_ids.size()));
  for (std::size_t i = 0; i < fibre_ids.size(); ++i) {
    const auto found = known.find(fibre_ids[i]);
    tensions_nN[static_cast<Index>(i)] =
        found != known.end() ? found->second : sum / static_cast<double>(std::max<std::size_t>(1, known.size()));
  }
  return tensions_nN;
}

cables::CableParameters inelastic(cables::CableParameters cables) {
  cables.axial_stiffness_nN = 0;
  return cables;
}

/// Without the fibres that came after the network: all networks of an ensemble have the same.
Cell with_fibres_of(const Network& network, Cell cell) {
  const auto is_new = [&](const Fibre& f) {
    return std::ranges::none_of(network.links, [&](const Link& link) { return link.fibre_id == f.fibre_id; });
  };
  std::erase_if(cell.fibres, is_new);
  return cell;
}

}  // namespace

std::vector<cables::CableNetwork> span_ensemble(const Network& first, const Cell& cell, const Parameters& p,
                                                int threads) {
  const Cell same = with_fibres_of(first, cell);
  std::vector<Network> networks(static_cast<std::size_t>(p.fit.n_meshes));
  networks.front() = first;
  numerics::parallel_for(p.fit.n_meshes - 1, threads, [&](int m) {
    mesh::NetworkParameters parameters = p.network;
    parameters.seed += static_cast<std::uint64_t>(m) + 1;
    networks[static_cast<std::size_t>(m) + 1] = mesh::generate_network(same, parameters).network;
  });
  std::vector<cables::CableNetwork> cables;
  for (Network& network : networks) cables.emplace_back(std::move(network), p.cables);
  return cables;
}

std::vector<cables::CableNetwork> span_ensemble(const Cell& cell, const Parameters& parameters, int threads) {
  return span_ensemble(mesh::generate_network(cell, parameters.network).network, cell, parameters, threads);
}

std::vector<cables::CableNetwork> of_cables(const std::vector<cables::CableNetwork>& networks,
                                            const cables::CableParameters& cables) {
  std::vector<cables::CableNetwork> result;
  for (const cables::CableNetwork& n : networks) result.emplace_back(n.network(), cables);
  return result;
}

Trial start_on(const cables::CableNetwork& network, const LinearData& data, const std::vector<int>& adhesion_ids,
               const std::optional<std::vector<Tension>>& before) {
  const TensionProblem problem(network, data.reduced, adhesion_ids);
  return before ? scaled_to_data(problem, tensions_of_groups(network.fibre_ids(), *before)) : uniform_start(problem);
}

StartedNetworks with_cables_called_for(std::vector<cables::CableNetwork> networks, const LinearData& data,
                                       const std::vector<int>& adhesion_ids,
                                       const std::optional<std::vector<Tension>>& before, const Parameters& p) {
  Trial start = start_on(networks.front(), data, adhesion_ids, before);
  const VectorXd& t = start.tensions_nN;
  Effect elasticity = cables::decide_elasticity(networks.front(), {t.data(), t.data() + t.size()}, p.effects);
  if (!elasticity.is_on) {
    networks = of_cables(networks, inelastic(p.cables));
    start = start_on(networks.front(), data, adhesion_ids, before);
  }
  return {std::move(networks), std::move(start), std::move(elasticity)};
}

std::optional<Effect> elasticity_after_all(const Effect& elasticity, const cables::CableNetwork& network,
                                           const Trial& answer, const Parameters& p) {
  if (elasticity.is_on || elasticity.setting != Switch::automatic) return {};
  const double share =
      cables::stretch_share(network.network(), cables::equilibrium_of(*answer.rest), p.cables.axial_stiffness_nN);
  if (share <= p.effects.effect_tolerance) return {};
  Effect on = elasticity;
  on.is_on = true;
  on.number = share;
  on.why += "; but at the tensions found without it " + brief(share) + ", above: fitted again";
  return on;
}

}  // namespace mbtfm::fit
