/// A plan as a whole, and what it says in words.
#pragma once

#include <algorithm>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mbtfm/plan/cell_numbers.h"
#include "mbtfm/plan/drawn.h"
#include "mbtfm/plan/parameters.h"
#include "pipeline/contract/numbers.h"

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

/// Two digits: no plan is better than that.
std::string about(double value);
/// "; a gel of 4 kPa needs 0.15, one of 16 kPa needs 1.2": of all gels but one. @param needs  what follows "needs"
std::string of_other_gels(const Asked& asked, double gel_kPa, const std::function<std::string(double E)>& needs);
/// What drawn experiments may be off by beyond chance: as much as such plans are off by anyway (docs/planning.md).
constexpr double kDrawnMargin = 0.1;

/// "Checked with 2 simulated experiments at 8 kPa, … of 1). ". @param density, what  "0.5 beads per µm²", "12 tensions"
template <class Drawn>
std::string checked_with(const Drawn& d, const std::string& density, const std::string& what) {
  return "Checked with " + std::to_string(d.n_experiments) +
         (d.n_experiments == 1 ? " simulated experiment" : " simulated experiments") + " at " +
         brief(d.point.youngs_modulus_kPa) + " kPa, " + density + " and " + brief(d.point.noise_um) +
         " µm: the errors of " + what + " were " + about(d.error_over_predicted) +
         " times those predicted (root mean square; by chance within " + about(2 * d.by_chance) + " of 1). ";
}

/// Of a plan's `needed`.
template <class Needed>
const Needed& needed_of(const std::vector<Needed>& needed, double youngs_modulus_kPa, double noise_um) {
  return *std::ranges::find_if(
      needed, [&](const Needed& n) { return n.youngs_modulus_kPa == youngs_modulus_kPa && n.noise_um == noise_um; });
}
/// "2.4", or "at most 0.25" where that is the least asked for.
std::string density_text(const std::vector<double>& densities, double needed);
/// The first density of the list that suffices, or else the largest.
double density_that_suffices(const std::vector<double>& densities, std::optional<double> needed);

/// "With your gel of 8 kPa and a noise of 0.05 um you need 0.6 beads per um² to see 1 nN per fibre to 20 %; a gel of
/// 4 kPa needs 0.15."
std::string answer_sentence(const Plan& plan);
/// What follows it: the adhesions, the cells, how well the drawn experiments bore it out.
std::vector<std::string> further_sentences(const Plan& plan);

}  // namespace mbtfm::plan
