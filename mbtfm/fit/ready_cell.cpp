#include "mbtfm/fit/ready_cell.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/effects.h"
#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tensions/model_error.h"
#include "mbtfm/tensions/placement.h"
#include "mbtfm/tensions/search.h"
#include "mbtfm/tensions/second_placement.h"
#include "network/cables/effects.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/parallel.h"
#include "substrate/choice/factory.h"
#include "substrate/loads.h"
#include "substrate/response.h"

namespace mbtfm::fit {

using namespace tensions;

namespace {

struct TakenCell {
  Cell cell;
  Effect fibres;
};

/// With fibres or without, as they are switched; the network must be of such a cell and held where the image cuts it.
TakenCell take_cell(const Inputs& inputs, const stage::EffectSwitches& switches) {
  TakenCell taken{.cell = inputs.cell, .fibres = {}};
  taken.fibres = cables::take_fibres(taken.cell, switches.stress_fibres);
  const auto has_fibre = [](const Link& link) { return link.fibre_id != 0; };
  if (!taken.fibres.is_on && std::ranges::any_of(inputs.network.links, has_fibre)) {
    throw InputError(inputs.network_file, "a network without stress fibres, as effects.stress_fibres says", "fibres",
                     "make it again: mbtfm-network with the same cell.toml");
  }
  for (const Link& link : inputs.network.links) {
    const auto is_it = [&](const Fibre& f) { return f.fibre_id == link.fibre_id; };
    if (link.fibre_id == 0 || std::ranges::any_of(taken.cell.fibres, is_it)) continue;
    throw InputError(inputs.network_file, "a network of the fibres in fibres.csv",
                     "fibre " + std::to_string(link.fibre_id) + ", which is not among them",
                     "make it again: mbtfm-network with the same cell");
  }
  if (cuts_of(taken.cell).empty() != inputs.network.held_by_cut.empty()) {
    throw InputError(inputs.network_file, "a network that the cut of outline.csv holds",
                     "of an outline with another cut", "make it again: mbtfm-network with the same cell");
  }
  return taken;
}

/// Candidates are where the lattice put them: only a switch that is on moves them.
PlacedCell place_on_beads(const GelUnderCell& on, const DisplacementField& beads, LinearData data,
                          const StartedNetworks& started) {
  const Parameters& p = on.parameters;
  const Switch setting = p.effects.channel_shift;
  const bool can_be_shifted = setting != Switch::automatic || !has_candidates(on.cell);
  PlacedCell place = place_cell(
      on.cell, started.networks.front(), beads, std::move(data),
      [&](const DisplacementField& there) { return data_of(on, there); }, p.gel, p.fit, started.start,
      can_be_shifted ? setting : Switch::off, on.threads);
  if (!can_be_shifted) {
    place.effect = stage::decided(
        EffectKind::channel_shift, setting, false,
        "candidates for adhesions have no place of their own: their lattice would be found, not the cell");
  }
  return place;
}

SeriesOnGel in_cell_frame(SeriesOnGel series, const DisplacementField& beads, const Placement& placement,
                          const GelUnderCell& on) {
  if (series.frames.empty()) return series;
  for (SeriesFrame& frame : series.frames) frame.beads = tensions::in_cell_frame(frame.beads, placement);
  series.response =
      responses_of(beads, series.frames, [&](const DisplacementField& b) { return response_of(on, b); }).of_series;
  return series;
}

std::optional<std::vector<Tension>> tensions_before(const Inputs& inputs, const Effect& time_coupling) {
  return time_coupling.is_on ? inputs.before : std::nullopt;
}

/// The pieces beyond the border where forces act count as other cells.
DataOfBeads with_unseen_neighbours(DataOfBeads given, Cell& cell, const GelUnderCell& on,
                                   const DisplacementField& beads) {
  if (on.parameters.effects.beyond_cut == Switch::off) return given;
  const std::vector<Polygon> pieces = neighbours_beyond_border(given.data, cell, on.parameters.gel);
  if (pieces.empty()) return given;
  cell.neighbours_um.insert(cell.neighbours_um.end(), pieces.begin(), pieces.end());
  given = data_of(on, beads, std::move(given.data.response));
  given.beyond->borders = borders_of(pieces, given.data.position_um);
  return given;
}

}  // namespace

ReadyCell with_cables(ReadyCell cell, const LinearData& data, const cables::CableParameters& cables,
                      const Inputs& inputs) {
  cell.networks = of_cables(cell.networks, cables);
  cell.start = start_on(cell.networks.front(), data, adhesion_ids_of(cell.scene.cell),
                        tensions_before(inputs, cell.decisions.time_coupling));
  return cell;
}

ReadyFit make_ready(const Inputs& inputs, const Parameters& p, const Work& work) {
  auto [cell, fibres] = take_cell(inputs, p.effects);
  std::unique_ptr<substrate::Substrate> gel = choice::make_substrate(p.gel, p.substrate, work.threads);
  const GelUnderCell on{.gel = *gel, .cell = cell, .parameters = p, .threads = work.threads};
  work.tell(0.05, "compliance of the substrate");
  Responses responses =
      responses_of(inputs.beads, inputs.frames, [&](const DisplacementField& beads) { return response_of(on, beads); });
  DataOfBeads at_rest =
      with_unseen_neighbours(data_of(on, inputs.beads, std::move(responses.of_beads)), cell, on, inputs.beads);
  BeadsOfState state = in_their_state(on, inputs.beads, std::move(at_rest.data), !inputs.frames.empty());
  work.tell(0.3, "spanning networks");
  const Effect coupling = decide_time_coupling(inputs.before || inputs.frames.size() > 1, p.effects.time_coupling);
  StartedNetworks started = with_cables_called_for(span_ensemble(inputs.network, cell, p, work.threads), state.data,
                                                   adhesion_ids_of(cell), tensions_before(inputs, coupling), p);
  work.tell(0.35, "placing the cell on the beads");
  PlacedCell place = place_on_beads(on, state.beads, std::move(state.data), started);
  SeriesOnGel series{.frames = inputs.frames, .response = std::move(responses.of_series)};
  if (place.effect.is_on) {
    state.beads = tensions::in_cell_frame(state.beads, place.placement);
    series = in_cell_frame(std::move(series), state.beads, place.placement, on);
    started.start = std::move(place.start);
  }
  ReadyCell ready{.gel = std::move(gel),
                  .scene = {.cell = cell, .beads = std::move(state.beads), .n_flagged = inputs.n_flagged},
                  .beyond = at_rest.beyond,
                  .placement = place.placement,
                  .networks = std::move(started.networks),
                  .start = std::move(started.start),
                  .series = std::move(series),
                  .decisions = {.fibres = fibres,
                                .under_load = std::move(state.effect),
                                .placement = std::move(place.effect),
                                .elasticity = std::move(started.elasticity),
                                .time_coupling = coupling}};
  return {std::move(ready), std::move(place.data)};
}

using namespace tensions;

namespace {

/// Across an adhesion of mean area.
double mean_size_um(const std::vector<Adhesion>& adhesions) {
  double area_um2 = 0;
  for (const Adhesion& a : adhesions) area_um2 += a.area_um2;
  return std::sqrt(area_um2 / static_cast<double>(std::max<std::size_t>(1, adhesions.size())));
}

Effect rest_of_series(Switch setting) {
  if (setting == Switch::on)
    throw UsageError("beads_under_load = on takes no time series: all frames share the beads' places at rest");
  return stage::decided(EffectKind::beads_under_load, setting, false,
                        "all frames of a series share the beads' places at rest");
}

}  // namespace

substrate::SharedResponse response_of(const GelUnderCell& on, const DisplacementField& beads) {
  return on.gel.response({substrate::ellipses_of(on.cell.adhesions)}, {points_of(beads)})->kept();
}

std::vector<bool> beads_in_region(const DisplacementField& beads, const Cell& cell, const FitParameters& p) {
  std::vector<bool> is_used;
  for (const Bead& b : beads) {
    const bool is_in_region = !p.region_um || contains(cell.outline_um, b.position_um) ||
                              distance_to_boundary_um(cell.outline_um, b.position_um) <= *p.region_um;
    is_used.push_back(is_in_region && !is_nearer_to_neighbour(cell, b.position_um));
  }
  return is_used;
}

DataOfBeads data_of(const GelUnderCell& on, const DisplacementField& beads, substrate::SharedResponse response) {
  const Parameters& p = on.parameters;
  DataOfBeads result{.data = reduce(beads, std::move(response), beads_in_region(beads, on.cell, p.fit), on.threads,
                                    allows_common_motion(p.effects) ? affine_motions(beads) : MatrixXd())};
  std::vector<Vec2> places_um;
  for (const Adhesion& a : on.cell.adhesions) places_um.push_back(a.position_um);
  result.data.balance = tensions::balance_of(places_um);
  if (!allows_forces_beyond(p.effects, on.cell)) return result;
  auto [data, beyond] = with_forces_beyond(std::move(result.data), on.cell, p.gel);
  return {std::move(data), beyond};
}

LinearData data_of(const GelUnderCell& on, const DisplacementField& beads) {
  return data_of(on, beads, response_of(on, beads)).data;
}

BeadsOfState in_their_state(const GelUnderCell& on, const DisplacementField& at_rest, LinearData data, bool is_series) {
  const stage::EffectSwitches& effects = on.parameters.effects;
  if (is_series) return {at_rest, std::move(data), rest_of_series(effects.beads_under_load)};
  const auto carried = [&](const LinearData& rest) {
    return carried_um(on.parameters.gel, substrate::ellipses_of(on.cell.adhesions), free_forces_nN(rest.reduced),
                      rest.position_um, rest.displacement_um, on.threads);
  };
  return take_state(
      at_rest, std::move(data), [&](const DisplacementField& beads) { return data_of(on, beads); },
      mean_size_um(on.cell.adhesions), effects.effect_tolerance, effects.beads_under_load, carried);
}

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
