/// The cell that is planned with, flat or in space: simulated, or one that was measured.
#pragma once

#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "mbtfm/fit/parameters.h"
#include "mbtfm/spatial/parameters.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/contract/beads_in_space.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/gel.h"
#include "samples/drawing/draw.h"
#include "samples/drawing/random.h"
#include "samples/experiment/experiment.h"
#include "samples/plan/parameters.h"
#include "substrate/compliance.h"

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

/// A place where the cell pulls, as an image would show it.
struct SpacePatch {
  Adhesion adhesion;
  Vec3 force_nN;
};

struct SpaceScene {
  std::string name;  ///< for people
  std::uint64_t seed = 1;
  Gel gel;  ///< with its surface
  std::vector<SpacePatch> patches;
  Polygon outline_um = {};  ///< may be empty
  // beads lie anywhere here, down to this depth below the surface
  Vec2 low_um = {}, high_um = {};
  double bead_depth_um = 0;
  double own_beads_per_um3 = 0;
  std::function<Vec3(const Vec3& at_um)> exact_um = {};  ///< displacement; empty: what the patches alone make of it
  tractions::TractionParameters traction = {};           ///< how experiments are evaluated
  spatial::SpatialParameters spatial = {};
  substrate::SubstrateParameters substrate = {};
  std::vector<std::string> warnings = {};  ///< what of a finished cell's settings a plan does not follow

  double volume_um3() const { return (high_um.x - low_um.x) * (high_um.y - low_um.y) * bead_depth_um; }
};

std::vector<Adhesion> adhesions_of(const SpaceScene& scene);

/// Whether the scenario is a cell in space. @throws UsageError where it is neither that nor a cell with fibres
bool is_in_space(const Parameters& parameters);
/// The scene's own field is exact.
SpaceScene simulated_in_space(const Parameters& parameters, int threads);

/// Whether the folder is that of a cell in space.
bool is_cell_in_space(const std::filesystem::path& folder);
/// Files that are read of such a cell.
inline const std::vector<std::string> kFilesOfCellInSpace = {"cell.toml", "1_segment/adhesions.csv",
                                                             "2_track/displacement_3d.csv", "3_surface/surface.vtp",
                                                             "4_traction/traction_adhesion_forces.csv"};
/// Of a finished cell: its surface, its adhesions and the forces found, the volume of its beads.
/// @throws InputError where a file is missing or malformed, or there are no forces on adhesions
SpaceScene measured_in_space(const std::filesystem::path& folder, const Parameters& parameters);

/// Random places of beads, whose displacements are still to be known.
std::vector<BeadInSpace> beads_in(const SpaceScene& scene, std::size_t n_beads, drawing::Random& random);

/// What is asked of a cell in space. @throws UsageError as asked_by(), or where beads by area are asked for
Asked asked_in_space(const Parameters& parameters, const SpaceScene& scene);

}  // namespace mbtfm::plan
