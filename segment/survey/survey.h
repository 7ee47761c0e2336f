/// What a cell's images are good for, found in about a second: before a night's batch, not in place of it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/beads.h"
#include "segment/images/channels.h"

namespace mbtfm::survey {

struct CellImages {
  std::optional<images::Channel> adhesion, actin, beads_stressed, beads_relaxed;  ///< as far as they are there
  DisplacementField given = {};                     ///< of another program, in place of the bead images
  std::optional<double> given_pixel_size_um;        ///< by cell.toml
  std::optional<double> given_beads_pixel_size_um;  ///< the same of the bead images alone
};

struct Survey {
  std::string facts;                ///< size, pixel, beads and their distance, margin: in one line
  std::vector<std::string> doubts;  ///< each: what was found, its limit and what to do
};

/// @throws InputError where no image tells the pixel size and cell.toml neither, or images that must be of one size are
/// not
Survey survey(const CellImages& images, int threads);

}  // namespace mbtfm::survey
