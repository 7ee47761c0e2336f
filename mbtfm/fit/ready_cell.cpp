#include "mbtfm/fit/ready_cell.h"

#include <algorithm>

#include "mbtfm/fit/data_of_beads.h"
#include "mbtfm/fit/networks.h"
#include "mbtfm/tensions/search.h"
#include "mbtfm/tensions/effects.h"
#include "mbtfm/tensions/second_placement.h"
#include "network/cables/effects.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "substrate/choice/factory.h"

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

}  // namespace mbtfm::fit
