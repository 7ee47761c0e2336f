/// A plan as a whole, what it says in words, and as pictures and a self-contained page.
#pragma once

#include "pipeline/contract/numbers.h"
#include "samples/plan/cell_numbers.h"
#include "samples/plan/parameters.h"
#include "samples/plan/space_grid.h"

namespace mbtfm::plan {

template <class Quantity>
struct PlanOf {
  std::string name;    ///< of the cell
  double own_kPa = 0;  ///< its gel
  Asked asked;
  GridOf<Quantity> grid;
  // of a flat cell
  Parameters parameters = {};
  double most_beads_per_um2 = 0;
  // in space
  double axial_noise = 0;
  double volume_um3 = 0;  ///< that beads lie in

  std::optional<Drawn> drawn = {};
  std::vector<CellNumbers> cells = {};  ///< flat
};
using Plan = PlanOf<Quantity>;
using SpacePlan = PlanOf<SpaceQuantity>;

/// Where experiments are drawn: the gel of the list that is the cell's own or the nearest to it, the first noise, the
/// density of the list that suffices or else the largest.
Point answered_point(const Asked& asked, const std::vector<Needed>& needed, double own_kPa);

/// Two digits: no plan is better than that.
std::string about(double value);
/// "2.4", or "at most 0.25" where that is the least asked for.
std::string density_text(const std::vector<double>& densities, double needed);

/// "With your gel of 8 kPa and a noise of 0.05 um you need 0.6 beads per um² to see 1 nN per fibre to 20 %; a gel of
/// 4 kPa needs 0.15."
std::string answer_sentence(const Plan& plan);
std::string answer_sentence(const SpacePlan& plan);
/// What follows it: the adhesions, the cells, how well the drawn experiments bore it out.
std::vector<std::string> further_sentences(const Plan& plan);
std::vector<std::string> further_sentences(const SpacePlan& plan);

/// A chart for each noise: standard error of the middle fibre or patch over density, a curve for each gel, the target
/// as a line.
template <class Quantity>
std::string svg_of(const PlanOf<Quantity>& plan);
template <class Quantity>
std::string html_of(const PlanOf<Quantity>& plan);

}  // namespace mbtfm::plan
