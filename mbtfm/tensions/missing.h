/// Fibres and adhesions that the beads show and the segmentation misses. The one that explains most comes first, and
/// becomes part of the fit: otherwise the others would get its force.
#pragma once

#include <vector>

#include "mbtfm/tensions/ensemble.h"
#include "mbtfm/tensions/error_budget.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/results.h"

namespace mbtfm::tensions {

struct WithMissing {
  EnsembleFit fit;
  std::vector<MissingFibre> fibres;
  std::vector<MissingFibre> fitted;        ///< of these, with the others: those that are sure, and no segmented one
  std::vector<MissingAdhesion> adhesions;  ///< the total force holds theirs
};

/// A fibre's tension is fitted again beside one that is missing. An adhesion's is not: a fibre whose adhesion was not
/// found ends in the network, which no force at that place puts right. The adhesions' forces are found beside both.
/// @param n_of_place  motions of the data, the last ones, that are the cell's place
WithMissing with_missing(EnsembleFit fit, const network::Ensemble& networks, const Cell& cell, const Gel& gel,
                         const SegmentationErrors& segmentation, const FitParameters& parameters, Index n_of_place,
                         int threads);

}  // namespace mbtfm::tensions
