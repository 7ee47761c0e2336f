/// Which stages a cell has: those of images in the plane, with fibres or as a sheet, or those of stacks in space.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "pipeline/contract/cell_kind.h"
#include "pipeline/contract/path.h"
#include "pipeline/contract/words.h"
#include "pipeline/runner/images.h"
#include "pipeline/runner/stages.h"
#include "pipeline/stage/parameters_fwd.h"

namespace mbtfm::runner {

/// What pulls at the beads of a flat gel.
enum class PullModel { fibres, sheet };
constexpr auto words(PullModel) { return std::array{"fibres", "sheet"}; }

/// The table [run] of cell.toml.
struct RunSettings {
  PullModel model = PullModel::fibres;  ///< what the program is for
  bool bundles = false;                 ///< most sheets have no fibres that pull by themselves
};
void declare(stage::ParameterList& list, RunSettings& settings);
/// @throws InputError for an unknown key or value, naming file and line
RunSettings read_run_settings(const fs::path& cell);

struct CellStages {
  CellKind kind = {};  ///< on a plane, by fibres
  std::string why;     ///< "track.z_points is set": for people
  std::vector<Stage> stages = {};
  std::vector<int> first = {};                ///< before all others
  std::vector<std::vector<int>> chains = {};  ///< which run beside each other; the last stage needs them all
};

/// Decided by cell.toml and the files beside it. A folder without images and settings of space is one of the plane.
/// @throws InputError where cell.toml cannot be read
CellStages stages_of(const fs::path& cell, const ImageNames& images);

/// In space, all of them: segment, track, surface, traction.
const std::vector<Stage>& stages_in_space();

/// Of a sheet, all of them: segment, track, sheet.
const std::vector<Stage>& stages_of_sheet();

/// Of all kinds, each name once.
const std::vector<Stage>& all_stages();

/// "segment, track, network, fit, surface, traction or sheet"
std::string stage_names();

std::string executable_of(const Stage& stage, const fs::path& stage_folder);
/// The program of a stage and its flags. @param cell  that its images lie in  @param folder  of cell.toml and of what
/// the stages write: the cell's own, or a copy of it
std::vector<std::string> command_of(const Stage& stage, const fs::path& stage_folder, const fs::path& cell,
                                    const fs::path& folder, const ImageNames& images, int threads);
/// Flags and files of the images that a stage compares with those of others; none where it looks at no others.
std::vector<std::string> to_look_at(const Stage& stage, const fs::path& cell, const ImageNames& images);

}  // namespace mbtfm::runner
