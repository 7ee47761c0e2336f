/// Writes a colony as a cell folder.
#pragma once

#include "continuum/sheet/forward.h"
#include "continuum/sheet/parameters.h"
#include "samples/colonies/parameters.h"
#include "samples/experiment/cell_folder.h"

namespace mbtfm::colonies {

struct Colony;

/// Everything that a scenario with a colony says.
struct Whole {
  drawing::ScenarioParameters scenario;
  ColonyParameters colony;
  sheet::SheetParameters sheet;
};

/// cell.toml with what a user would know (gel, thickness and Poisson's ratio of the cells), 1_segment/outline.csv,
/// truth/; and in place of images 2_track/displacement.csv.
void write_folder(const Colony& colony, const sheet::Solution& solution, const Whole& whole,
                  const experiment::FileNamer& file);

/// beads_relaxed.tif, beads_stressed.tif, phase.tif and truth/beads.csv. @param scenario  with the colony's own seed
void write_images(const Colony& colony, const drawing::ScenarioParameters& scenario, const experiment::FileNamer& file,
                  const Work& work);

}  // namespace mbtfm::colonies
