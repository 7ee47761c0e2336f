/// Which fibre of one segmentation is which of another, by where they lie.
#pragma once

#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"

namespace mbtfm::report {

struct FibreMatchParameters {
  /// Two lines further apart on average are different fibres: about the spacing of bundles that one can resolve, and
  /// it admits a fibre that was followed over 60 % of its length or more (a 10 um long one that lacks 4 um at an end
  /// is 0.4 · 2 um = 0.8 um away).
  double largest_distance_um = 1.5;
  double step_um = 0.25;  ///< between the points at which the distance is taken: fine against largest_distance_um
};

/// Mean distance of the points of each line from the other line; of the two directions, the larger.
double line_distance_um(const Polyline& a, const Polyline& b, double step_um);

struct FibreMatch {
  int found_index = 0;
  int true_index = 0;
  double distance_um = 0;
};

/// Pairs of one found and one true fibre each, the closest first; fibres without a partner are left out.
std::vector<FibreMatch> match_fibres(const std::vector<Fibre>& found, const std::vector<Fibre>& truth,
                                     const FibreMatchParameters& parameters = {});

}  // namespace mbtfm::report
