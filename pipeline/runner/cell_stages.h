/// Which stages a cell has: that of images in the plane, or that of stacks in space.
#pragma once

#include <array>
#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/contract/words.h"
#include "pipeline/runner/images.h"
#include "pipeline/runner/stages.h"

namespace mbtfm::runner {

/// Where a cell's beads are followed.
enum class CellKind {
  plane,  ///< on a flat gel: segment, track, network, fit
  space   ///< in the volume of a gel, which may be curved: segment where there are images of the cell, track, surface,
          ///< traction
};
constexpr auto words(CellKind) { return std::array{"plane", "space"}; }

struct CellStages {
  CellKind kind = CellKind::plane;
  std::string why;  ///< "track.z_points is set": for people
  std::vector<Stage> stages;
  std::vector<int> first = {};           ///< before all others
  std::vector<std::vector<int>> chains;  ///< which run beside each other; the last stage needs them all
};

/// Decided by cell.toml and the files beside it. A folder without images and settings of space is one of the plane.
/// @throws InputError where cell.toml cannot be read
CellStages stages_of(const std::filesystem::path& cell, const ImageNames& images);

/// In space, all of them: segment, track, surface, traction.
const std::vector<Stage>& stages_in_space();

/// Of both kinds, each name once.
const std::vector<Stage>& all_stages();

/// "segment, track, network, fit, surface or traction"
std::string stage_names();

}  // namespace mbtfm::runner
