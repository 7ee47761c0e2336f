/// A plan of a cell in space as a whole: what it says in words, its tables.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mbtfm/plan/space_drawn.h"
#include "pipeline/files/columns.h"

namespace mbtfm::plan {

struct SpacePlan {
  std::string name;    ///< of the cell
  double own_kPa = 0;  ///< its gel
  double axial_noise = 0;
  double volume_um3 = 0;  ///< that beads lie in
  Asked asked;
  SpaceGrid grid;
  std::optional<SpaceDrawn> drawn;
};

/// Where experiments are drawn: as answered_point() of a flat gel.
SpacePoint answered_point(const Asked& asked, const SpaceGrid& grid, double own_kPa);
std::string answer_sentence(const SpacePlan& plan);
std::vector<std::string> further_sentences(const SpacePlan& plan);

files::Table<SpaceExpected> space_expected_table();
files::Table<SpaceNeeded> space_needed_table();
files::Table<SpaceDrawnForce> space_drawn_table();

}  // namespace mbtfm::plan
