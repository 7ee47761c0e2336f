/// Writes a scene on a gel as a cell folder.
#pragma once

#include <filesystem>
#include <functional>

#include "pipeline/contract/stage_report.h"
#include "pipeline/contract/work.h"
#include "samples/drawing/scenario.h"
#include "samples/gels/scene.h"

namespace mbtfm::gels {

/// Where to write a file of the folder.
using FileNamer = std::function<std::filesystem::path(const std::string& file)>;

SceneSize size_of(const drawing::ScenarioParameters& parameters);

/// cell.toml, surface.vtp, truth/ and, in place of images, 2_track/displacement_3d.csv.
void write_folder(const GelScene& scene, const SpaceParameters& space, const drawing::ScenarioParameters& parameters,
                  const FileNamer& file);

/// The stacks of beads; those of the gel's surface where there are such beads; truth/slices.csv.
void write_stacks(const GelScene& scene, const SpaceParameters& space, const drawing::ScenarioParameters& parameters,
                  const FileNamer& file, int threads, const Progress& progress);

StageReport report_of(const GelScene& scene, SpaceScene kind);

}  // namespace mbtfm::gels
