/// A plan as a whole, and what it says in words.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mbtfm/plan/cell_numbers.h"
#include "mbtfm/plan/drawn.h"

namespace mbtfm::plan {

struct Plan {
  std::string name;    ///< of the cell
  double own_kPa = 0;  ///< its gel
  Parameters parameters;
  Asked asked;
  Grid grid;
  double most_beads_per_um2 = 0;
  std::optional<Drawn> drawn;
  std::vector<CellNumbers> cells;
};

/// The gel of the list that the answer speaks of: the cell's own, or the nearest to it.
double answered_gel_kPa(const Asked& asked, double own_kPa);
/// Where experiments are drawn: that gel, the first noise, the density of the list that suffices or else the largest.
Point answered_point(const Asked& asked, const Grid& grid, double own_kPa);

/// "With your gel of 8 kPa and a noise of 0.05 um you need 0.6 beads per um² to see 1 nN per fibre to 20 %; a gel of
/// 4 kPa needs 0.15."
std::string answer_sentence(const Plan& plan);
/// What follows it: the adhesions, the cells, how well the drawn experiments bore it out.
std::vector<std::string> further_sentences(const Plan& plan);

}  // namespace mbtfm::plan
