#include "pipeline/report/hover.h"

#include <fmt/format.h>

#include <algorithm>

#include "pipeline/report/numbers.h"
#include "pipeline/report/results.h"
#include "pipeline/report/tension_plot.h"

namespace mbtfm::report {

std::string hover_of(const Fibre& fibre, const CellResults& results) {
  std::string text = fmt::format("fibre {} ({})", fibre.fibre_id, full_name_of(fibre.type));
  if (const auto found = results.tensions.find(fibre.fibre_id); found == results.tensions.end()) {
    text += "\nnot fitted";
  } else {
    const Tension& t = found->second;
    text += "\ntension " + readable(t.tension_nN) + " nN";
    if (t.low_nN && t.high_nN)
      text += fmt::format(" (95 % interval {} to {})", readable(*t.low_nN), readable(*t.high_nN));
    if (!t.identifiable) text += "\nnot identifiable: disregard";
  }
  text += fmt::format("\n{} µm long", readable(length_um(fibre.points_um)));
  std::string ends;
  for (const auto& id : {fibre.start_adhesion_id, fibre.end_adhesion_id})
    if (id) ends += (ends.empty() ? "" : " and ") + std::to_string(*id);
  return text + (ends.empty() ? ", on no adhesion" : ", on adhesion " + ends);
}

std::string hover_of(const Adhesion& adhesion, const CellResults& results) {
  std::string text =
      fmt::format("{} {}", is_assumed(adhesion.origin) ? name_of(adhesion.origin) : "adhesion", adhesion.adhesion_id);
  if (is_assumed(adhesion.origin)) text += " (assumed, not seen)";
  const auto force = std::ranges::find_if(
      results.forces, [&](const AdhesionForce& f) { return f.adhesion_id == adhesion.adhesion_id; });
  if (force == results.forces.end()) {
    text += "\nnot fitted";
  } else {
    const double force_nN = norm(force->force_nN);
    const bool has_error = force->sigma_nN && *force->sigma_nN > 0;
    const std::optional<int> decimals = has_error ? std::optional(decimals_for(*force->sigma_nN)) : std::nullopt;
    text += "\nforce " + rounded(force_nN, decimals);
    if (has_error) text += " ± " + rounded(*force->sigma_nN, decimals);
    text += " nN\ntraction " + readable(force_nN / area_stood_for_um2(adhesion)) + " kPa";
  }
  text += (adhesion.origin == AdhesionOrigin::candidate ? "\nlattice cell " : "\narea ") +
          readable(area_stood_for_um2(adhesion)) + " µm²";
  std::string fibres;
  for (const Fibre& fibre : results.cell.fibres)
    if (fibre.start_adhesion_id == adhesion.adhesion_id || fibre.end_adhesion_id == adhesion.adhesion_id)
      fibres += (fibres.empty() ? "" : ", ") + std::to_string(fibre.fibre_id);
  return text + (fibres.empty() ? ", no fibre ends on it" : ", fibre " + fibres);
}

}  // namespace mbtfm::report
