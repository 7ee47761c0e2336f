/// Fibres and adhesions that the beads show and the segmentation misses. The kind that explains most is the cause: it
/// becomes part of the fit, as the others would get its force, and both are asked again with it.
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

/// The first of these more than the first of those. @param adhesions, fibres  the one that explains most ahead
bool explains_more(const std::vector<MissingAdhesion>& adhesions, const std::vector<MissingFibre>& fibres);

/// Where they are looked for.
struct CellSearched {
  network::Ensemble networks;
  const Cell& cell;
  const Gel& gel;
  const SegmentationErrors& segmentation;
  const FitParameters& parameters;
  Index n_of_place = 0;  ///< motions of the data, the last ones, that are the cell's place
  int threads = 1;
};

/// A fibre's tension is fitted again with one that is missing. An adhesion's is not: a fibre whose adhesion was not
/// found ends in the network, which no force at that place puts right (held_at()). The adhesions' forces are found
/// beside both.
WithMissing with_missing(EnsembleFit fit, const CellSearched& on);

}  // namespace mbtfm::tensions
