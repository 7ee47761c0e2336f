/// Writes an experiment as a cell folder.
#pragma once

#include <filesystem>
#include <functional>

#include "pipeline/contract/stage_report.h"
#include "samples/experiment/experiment.h"

namespace mbtfm::experiment {

/// Where to write a file of the cell folder.
using FileNamer = std::function<std::filesystem::path(const std::string& file)>;

/// @throws UsageError if the folder holds what no simulation made: a cell of the user's own
void expect_simulated(const std::filesystem::path& cell);
/// Images beside the true segmentation of an earlier experiment would never be looked at: it would pass for the user's.
void refuse_given_segmentation(const std::filesystem::path& cell);

/// cell.toml; truth/; and in place of images the true segmentation and the noisy displacement.
void write_cell_folder(const Experiment& experiment, const drawing::ScenarioParameters& parameters,
                       const FileNamer& file);

/// beads_relaxed.tif, beads_stressed.tif and truth/beads.csv; the noise is in the stressed positions. The measured
/// field is in the frame of the latter, from which the stage has moved the relaxed picture.
void write_bead_images(const DisplacementField& measured, const drawing::ScenarioParameters& parameters,
                       const FileNamer& file, const Work& work);

/// The four images, and truth/beads.csv. The noise is in the stressed positions of the beads.
void write_images(const Experiment& experiment, const drawing::ScenarioParameters& parameters, const FileNamer& file,
                  const Work& work);

StageReport report_of(const Experiment& experiment, const std::string& scenario);

}  // namespace mbtfm::experiment
