#include "mbtfm/tensions/missing.h"

#include <algorithm>

#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tensions/missing_adhesions.h"
#include "mbtfm/tensions/model_checks.h"

namespace mbtfm::tensions {

namespace {

/// The segmented fibre whose ends lie near these two adhesions: the beads then show where it ends, and no other fibre.
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

/// Three standard errors: all beads together have called for it, this is what its own force is known to. Five beside
/// assumed adhesions: next to such a lattice a force elsewhere is much of the lattice's own error.
bool is_sure(const MissingAdhesion& adhesion, bool beside_assumed) {
  return adhesion.chi_squared_gain >= (beside_assumed ? 25 : 9);
}

/// A fibre that leaves nothing to a segmented one, of which the beads showed a tension, is that fibre seen elsewhere.
bool takes_over(const EnsembleFit& before, const EnsembleFit& after) {
  constexpr double kShown = 2;  // standard errors
  for (std::size_t i = 1; i < before.tensions.nN.size(); ++i) {
    const Estimate& was = before.tensions.nN[i];
    if (was.value > kShown * was.standard_error && after.tensions.nN[i].value <= 0) return true;
  }
  return false;
}

/// The search, and what it has found so far.
class SearchForMissing {
 public:
  SearchForMissing(EnsembleFit fit, const CellSearched& on)
      : on_(on), without_(fit), found_{.fit = std::move(fit), .fibres = {}, .fitted = {}, .adhesions = {}} {}

  /// Beside all that was found before.
  std::vector<MissingFibre> fibres() const {
    if (!are_fibres_asked_) return {};
    return missing_fibres(found_.fit, on_.cell.adhesions, on_.segmentation, on_.threads);
  }
  std::vector<MissingAdhesion> adhesions() const {
    return missing_adhesions(found_.fit, on_.cell, on_.gel, on_.threads);
  }
  /// @return whether any of these stay
  bool add(const std::vector<MissingAdhesion>& adhesions) {
    const std::size_t n_before = found_.adhesions.size();
    found_.adhesions.insert(found_.adhesions.end(), adhesions.begin(), adhesions.end());
    find_forces();
    return found_.adhesions.size() > n_before;
  }
  /// Those that are sure, and no segmented ones, are fitted, and the others are asked again; or all are named.
  void add(std::vector<MissingFibre> fibres) {
    std::vector<MissingFibre> unseen;
    for (MissingFibre& fibre : fibres) {
      fibre.beside_fibre_id = fibre_beside(fibre, on_.cell);
      if (!fibre.beside_fibre_id && is_sure(fibre)) unseen.push_back(fibre);
    }
    are_fibres_asked_ = !unseen.empty() && fit_with(unseen);
    const std::vector<MissingFibre>& named = are_fibres_asked_ ? unseen : fibres;
    found_.fibres.insert(found_.fibres.end(), named.begin(), named.end());
  }
  WithMissing found() && { return std::move(found_); }

 private:
  bool fit_with(const std::vector<MissingFibre>& unseen) {
    const Trial start = next_start(without_);
    EnsembleFit with =
        fit_ensemble(on_.networks, with_missing_fibres(without_.data, on_.cell.adhesions, unseen, on_.n_of_place),
                     adhesion_ids_of(on_.cell), on_.parameters, on_.threads, {}, &start);
    if (takes_over(without_, with)) return false;
    without_ = std::move(with);
    found_.fitted.insert(found_.fitted.end(), unseen.begin(), unseen.end());
    find_forces();
    return true;
  }
  /// Beside the adhesions' own; those that these explain as well are no cause.
  void find_forces() {
    std::vector<MissingAdhesion>& places = found_.adhesions;
    found_.fit = without_;
    for (bool has_changed = true; has_changed && !places.empty();) {
      EnsembleFit with = with_their_forces(without_, places, on_.gel, on_.n_of_place);
      has_changed = std::erase_if(places, [&](const MissingAdhesion& a) { return !is_sure(a, is_assumed_); }) > 0;
      if (!has_changed) found_.fit = std::move(with);
    }
    std::ranges::stable_sort(places, std::greater(), &MissingAdhesion::chi_squared_gain);
  }

  const CellSearched& on_;
  EnsembleFit without_;  ///< the forces at missing adhesions
  WithMissing found_;
  bool are_fibres_asked_ = true;
  bool is_assumed_ = are_assumed(on_.cell.adhesions);
};

}  // namespace

bool explains_more(const std::vector<MissingAdhesion>& adhesions, const std::vector<MissingFibre>& fibres) {
  return !adhesions.empty() && (fibres.empty() || adhesions.front().chi_squared_gain > fibres.front().chi_squared_gain);
}

WithMissing with_missing(EnsembleFit fit, const CellSearched& on) {
  constexpr int kMostRounds = 6;
  SearchForMissing search(std::move(fit), on);
  for (int round = 0; round < kMostRounds; ++round) {
    std::vector<MissingFibre> fibres = search.fibres();
    const std::vector<MissingAdhesion> adhesions = search.adhesions();
    if (explains_more(adhesions, fibres) && search.add(adhesions)) continue;
    if (fibres.empty()) break;
    search.add(std::move(fibres));
  }
  return std::move(search).found();
}

}  // namespace mbtfm::tensions
