/// What the fit of a cell is made of.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mbtfm/tensions/series.h"
#include "pipeline/contract/beads.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/network.h"
#include "pipeline/contract/results.h"

namespace mbtfm::fit {

struct Inputs {
  Cell cell;                                  ///< with its fibres, whether the network has them or not
  std::optional<Cell> second_placement = {};  ///< with its candidates for adhesions at other places
  Network network;
  std::string network_file = {};  ///< for messages
  DisplacementField beads;        ///< without the flagged ones
  int n_flagged = 0;
  std::optional<std::vector<Tension>> before = {};    ///< of the frame before
  std::vector<tensions::SeriesFrame> frames = {};     ///< of a time series
  std::vector<tensions::FrameFit> known_frames = {};  ///< fits of an earlier run that was alike
};

}  // namespace mbtfm::fit
