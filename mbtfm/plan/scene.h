/// The cell that is planned with: simulated, or one that was measured.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "mbtfm/fit/parameters.h"
#include "mbtfm/plan/parameters.h"
#include "pipeline/contract/extent.h"
#include "samples/drawing/draw.h"
#include "samples/experiment/experiment.h"

namespace mbtfm::plan {

struct Scene {
  std::string name;                        ///< for people
  drawing::DrawnCell cell;                 ///< with the tensions of its fibres
  drawing::ScenarioParameters experiment;  ///< how experiments with it are simulated; its gel is the cell's own
  fit::Parameters fit;                     ///< how they are evaluated
  Extent field;                            ///< where beads may lie
};

/// @throws UsageError where there is no such scenario
Scene simulated_scene(const Parameters& parameters);

/// Files that are read of a measured cell.
inline const std::vector<std::string> kFilesOfCell = {"cell.toml",
                                                      "1_segment/adhesions.csv",
                                                      "1_segment/fibres.csv",
                                                      "1_segment/fibre_points.csv",
                                                      "1_segment/outline.csv",
                                                      "4_fit/tensions.csv",
                                                      "2_track/displacement.csv"};
/// Of a finished cell: its segmentation, the tensions found, the rectangle of its beads.
/// @throws InputError where a file is missing or malformed
Scene measured_scene(const std::filesystem::path& folder, const Parameters& parameters);

/// Random places of beads on the field. @param draw  each has its own
std::vector<Vec2> beads_on(const Scene& scene, double beads_per_um2, std::uint64_t draw);

}  // namespace mbtfm::plan
