#include "mbtfm/tensions/second_placement.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "mbtfm/tensions/ensemble.h"
#include "pipeline/contract/errors.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/own_files.h"

namespace mbtfm::tensions {

namespace {

double spread(double a, double b) { return std::abs(a - b) / std::numbers::sqrt2; }

void add(double& part, double more) { part = std::hypot(part, more); }

}  // namespace

PlacementSpread spread_between(const EnsembleFit& first, const EnsembleFit& second) {
  PlacementSpread result;
  for (std::size_t i = 0; i < first.tensions.fibre_ids.size(); ++i) {
    const auto at = std::ranges::find(second.tensions.fibre_ids, first.tensions.fibre_ids[i]);
    if (at == second.tensions.fibre_ids.end()) continue;
    const auto j = static_cast<std::size_t>(at - second.tensions.fibre_ids.begin());
    result.tensions_nN[*at] = spread(first.tensions.nN[i].value, second.tensions.nN[j].value);
  }
  result.total_force_nN = spread(first.total_force_nN.value, second.total_force_nN.value);
  if (first.cut && second.cut)
    result.cut_force_nN = spread(first.cut->magnitude_nN.value, second.cut->magnitude_nN.value);
  return result;
}

ErrorBudget with_spread(ErrorBudget budget, const PlacementSpread& spread) {
  for (TensionError& tension : budget.tensions) {
    const auto found = spread.tensions_nN.find(tension.fibre_id);
    if (found != spread.tensions_nN.end()) add(tension.parts_nN.segmentation, found->second);
  }
  add(budget.total_force_parts_nN.segmentation, spread.total_force_nN);
  if (budget.cut_force) add(budget.cut_force->parts_nN.segmentation, spread.cut_force_nN);
  return budget;
}

bool has_candidates(const Cell& cell) {
  return std::ranges::any_of(cell.adhesions, [](const Adhesion& a) { return a.origin == AdhesionOrigin::candidate; });
}

std::optional<Cell> second_placement(const Path& folder, const Cell& cell) {
  if (!has_candidates(cell)) return std::nullopt;
  if (!std::ranges::all_of(kSecondPlacementFiles,
                           [&](const std::string& name) { return files::is_own_file(folder / name); }))
    return std::nullopt;
  Cell second = cell;
  second.adhesions = files::read_adhesions(folder / kSecondPlacementFiles[0]);
  second.fibres = files::read_fibres(folder / kSecondPlacementFiles[1], folder / kSecondPlacementFiles[2]);
  try {
    check(second);
  } catch (const InvalidData& error) {
    throw InputError((folder / kSecondPlacementFiles[1]).string() + ": " + error.element, error.expected, error.found,
                     "run the segmentation again");
  }
  return second;
}

}  // namespace mbtfm::tensions
