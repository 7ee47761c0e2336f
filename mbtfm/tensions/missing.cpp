#include "mbtfm/tensions/missing.h"

#include <algorithm>

#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tensions/missing_adhesions.h"
#include "mbtfm/tensions/model_checks.h"

namespace mbtfm::tensions {

namespace {

/// The segmented fibre whose ends lie beside these two adhesions: the beads then tell where it ends and of no other.
std::optional<int> fibre_beside(const MissingFibre& missing, const Cell& cell) {
  constexpr double kNear_um = 2;  // of an adhesion's rim
  const auto adhesion = [&](int id) { return *std::ranges::find(cell.adhesions, id, &Adhesion::adhesion_id); };
  const Adhesion a = adhesion(missing.start_adhesion_id), b = adhesion(missing.end_adhesion_id);
  for (const Fibre& fibre : cell.fibres) {
    const Vec2 start = fibre.points_um.front(), end = fibre.points_um.back();
    if ((covers(a, start, kNear_um) && covers(b, end, kNear_um)) ||
        (covers(b, start, kNear_um) && covers(a, end, kNear_um)))
      return fibre.fibre_id;
  }
  return std::nullopt;
}

/// Ten standard errors: the ends of segmented fibres that bend by a twentieth of their length pull aside by up to nine
/// (`other_network wrong`), as fibres of other ends would.
bool is_sure(const MissingFibre& fibre) { return fibre.chi_squared_gain >= 100; }

/// Five standard errors, as chance has of a place in one cell of a hundred.
bool is_sure(const MissingAdhesion& adhesion) { return adhesion.chi_squared_gain >= 25; }

/// A fibre that leaves nothing to a segmented one, of which the beads showed a tension, is that fibre seen elsewhere.
bool takes_over(const EnsembleFit& before, const EnsembleFit& after) {
  constexpr double kShown = 2;  // standard errors
  for (std::size_t i = 1; i < before.tensions.nN.size(); ++i) {
    const Estimate& was = before.tensions.nN[i];
    if (was.value > kShown * was.standard_error && after.tensions.nN[i].value <= 0) return true;
  }
  return false;
}

/// They lead the list of each.
bool explains_more(const std::vector<MissingAdhesion>& adhesions, const std::vector<MissingFibre>& fibres) {
  return !adhesions.empty() && (fibres.empty() || adhesions.front().chi_squared_gain > fibres.front().chi_squared_gain);
}

}  // namespace

WithMissing with_missing(EnsembleFit fit, const network::Ensemble& networks, const Cell& cell, const Gel& gel,
                         const SegmentationErrors& segmentation, const FitParameters& parameters, Index n_of_place,
                         int threads) {
  const auto fibres_in = [&](const EnsembleFit& of) {
    return missing_fibres(of, cell.adhesions, segmentation, threads);
  };
  const auto adhesions_in = [&](const EnsembleFit& of) { return missing_adhesions(of, of.data, cell, gel, threads); };
  WithMissing found{.fit = std::move(fit), .fibres = {}, .fitted = {}, .adhesions = {}};
  found.fibres = fibres_in(found.fit);
  found.adhesions = adhesions_in(found.fit);
  if (explains_more(found.adhesions, found.fibres) && !found.fibres.empty())
    found.fibres = fibres_in(with_their_forces(found.fit, found.adhesions, gel, n_of_place));
  std::vector<MissingFibre> unseen;
  for (MissingFibre& fibre : found.fibres) {
    fibre.beside_fibre_id = fibre_beside(fibre, cell);
    if (!fibre.beside_fibre_id && is_sure(fibre)) unseen.push_back(fibre);
  }
  if (!unseen.empty()) {
    const Trial start = next_start(found.fit);
    EnsembleFit with = fit_ensemble(networks, with_missing_fibres(found.fit.data, cell.adhesions, unseen, n_of_place),
                                    adhesion_ids_of(cell), parameters, threads, {}, &start);
    if (!takes_over(found.fit, with)) {
      found.fit = std::move(with);
      found.fitted = std::move(unseen);
      found.adhesions = adhesions_in(found.fit);
    }
  }
  // What the adhesions' own forces explain as well is no cause.
  for (bool has_changed = true; has_changed && !found.adhesions.empty();) {
    EnsembleFit with = with_their_forces(found.fit, found.adhesions, gel, n_of_place);
    has_changed = std::erase_if(found.adhesions, [](const MissingAdhesion& a) { return !is_sure(a); }) > 0;
    if (!has_changed) found.fit = std::move(with);
  }
  return found;
}

}  // namespace mbtfm::tensions
