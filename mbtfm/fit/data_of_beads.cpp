#include "mbtfm/fit/data_of_beads.h"

#include <algorithm>
#include <cmath>

#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tensions/placement.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "substrate/loads.h"
#include "substrate/response.h"

namespace mbtfm::fit {

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
  for (const Adhesion& a : on.cell.adhesions) result.data.load_centre_um.push_back(a.position_um);
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

}  // namespace mbtfm::fit
