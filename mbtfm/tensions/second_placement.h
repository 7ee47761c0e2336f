/// Forces on candidates for adhesions that nobody saw: how much it matters where the candidates are. The segmentation
/// places them twice, and the fit of the second placement shows what the choice is worth.
#pragma once

#include <map>
#include <optional>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/path.h"
#include "pipeline/contract/results.h"

namespace mbtfm::tensions {

struct EnsembleFit;

/// Standard errors by the choice of a placement: two answers a and b have the variance (a − b)²/2 about all answers.
/// What two ensembles of meshes differ by is in it, too.
struct PlacementSpread {
  std::map<int, double> tensions_nN;  ///< by fibre id, of those that both have
  double total_force_nN = 0;
  double cut_force_nN = 0;
};
PlacementSpread spread_between(const EnsembleFit& first, const EnsembleFit& second);

/// The budget with the spread in its part `segmentation`.
ErrorBudget with_spread(ErrorBudget budget, const PlacementSpread& spread);

/// Adhesions that nobody saw are among the cell's.
bool has_candidates(const Cell& cell);

/// adhesions_2.csv, fibres_2.csv and fibre_points_2.csv of a segmentation.
inline const std::vector<std::string> kSecondPlacementFiles = {"adhesions_2.csv", "fibres_2.csv", "fibre_points_2.csv"};
/// The cell with its second placement. None where its adhesions were seen, or where the files are not there.
/// @throws InputError where they contradict each other
std::optional<Cell> second_placement(const Path& folder, const Cell& cell);

}  // namespace mbtfm::tensions
