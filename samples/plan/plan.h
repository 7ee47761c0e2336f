/// What a plan is made of, whether the cell is flat or in space.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/gel.h"
#include "pipeline/contract/words.h"
#include "pipeline/numerics/order_statistics.h"
#include "samples/plan/parameters.h"

namespace mbtfm::plan {

/// The density of the beads is by area (1/um²), or of a cell in space by volume (1/um³).
struct Point {
  double youngs_modulus_kPa = 0, density = 0, noise_um = 0;
  bool operator==(const Point&) const = default;
};

/// What is estimated of a flat cell. Of those that there are many of in a cell the plan gives the middle one.
enum class Quantity {
  fibres,
  dorsal,
  arc,
  ventral,
  edge,
  unclassified,
  network_force,
  total_force,
  adhesion_force,
  free_force,
  fttc_force
};
constexpr auto words(Quantity) {
  return std::array{"fibre",          "dorsal fibre",         "transverse arc",        "ventral fibre",
                    "edge fibre",     "unclassified fibre",   "network force",         "total force",
                    "adhesion force", "adhesion force alone", "adhesion force by FTTC"};
}
inline constexpr Quantity kOfTypes[] = {Quantity::dorsal, Quantity::arc, Quantity::ventral, Quantity::edge,
                                        Quantity::unclassified};  ///< in the order of kFibreTypes
/// What is estimated in space. Of patches the plan gives the middle one.
enum class SpaceQuantity { force, tangential_force, normal_force, total_force, net_force };
constexpr auto words(SpaceQuantity) {
  return std::array{"patch force", "patch force along the surface", "patch force normal to it", "total force",
                    "net force"};
}

/// Of a quantity at a point. Of many, medians; share_within counts. fttc_force has no bound: its errors are those of
/// one drawn experiment.
template <class Quantity>
struct ExpectedOf {
  Point point;
  Quantity quantity = {};
  int n = 0;
  double standard_error_nN = 0;
  double from_beads_nN = 0;
  double from_mesh_nN = 0, from_segmentation_nN = 0, from_other_nN = 0;  ///< of a flat cell
  double from_background_nN = 0;                                         ///< in space
  double target_nN = 0;
  double share_within = 0;  ///< of the n
  double smallest_seen_nN = 0;
  std::optional<double> resolution_um = {};      ///< in space: at the patches
  std::optional<double> least_distance_um = {};  ///< of two adhesions whose forces are resolved if neither network
                                                 ///< nor background pulls; none: they never are
  double degrees = 0;                            ///< in space: how many numbers the beads determine
  double largest_displacement_um = 0;
  double left_out = 0;  ///< of the displacement, by linear elasticity
};
using Expected = ExpectedOf<Quantity>;
using SpaceExpected = ExpectedOf<SpaceQuantity>;

/// What a cell on a gel needs. No less than the least density that was asked for: few beads determine less than the
/// law predicts.
struct Needed {
  double youngs_modulus_kPa = 0, noise_um = 0;
  std::optional<double> density;  ///< so that the middle fibre or patch meets the target; none: no density does, or in
                                  ///< space most_beads_per_um3() does not
  std::optional<double> of_most;  ///< the same of nine in ten
};

template <class Quantity>
struct GridOf {
  std::vector<ExpectedOf<Quantity>> expected;
  std::vector<Needed> needed;  ///< by gel, then noise
  std::vector<std::string> warnings;
  double touching_um = 0;     ///< flat: distance of two adhesions of the median size that touch
  double model_error_nN = 0;  ///< flat: of the middle fibre, however many beads there are
};
using Grid = GridOf<Quantity>;
using SpaceGrid = GridOf<SpaceQuantity>;

template <class Quantity>
const ExpectedOf<Quantity>& expected_of(const GridOf<Quantity>& grid, const Point& point, Quantity quantity) {
  return *std::ranges::find_if(
      grid.expected, [&](const ExpectedOf<Quantity>& e) { return e.quantity == quantity && e.point == point; });
}

/// Of a patch's force: as it goes along the surface, out of the surface, and square to both.
enum class SpaceComponent { tangential, normal, across };
constexpr auto words(SpaceComponent) { return std::array{"along the surface", "normal", "across"}; }

/// A fibre's tension, or a component of a patch's force, in one experiment.
struct DrawnNumber {
  int experiment = 0, id = 0;                             ///< of the fibre, or the patch's adhesion
  SpaceComponent component = SpaceComponent::tangential;  ///< in space
  double true_nN = 0, found_nN = 0;
  double predicted_error_nN = 0;  ///< by the plan
  double stated_error_nN = 0;     ///< flat: by the fit itself, which knows nothing of the segmentation's errors
};

/// Errors of single adhesions' forces along their direction: 1.48 times the median magnitude, which is the standard
/// deviation of a normal variable.
struct ForceErrors {
  double with_network_nN = 0;  ///< forces of the tension fit
  double alone_nN = 0;         ///< forces independent of each other: adhesion-forces
  double fttc_nN = 0;          ///< tractions of FTTC summed up over each adhesion and 1.5 um around it
};

/// Experiments drawn to check what the plan says of them.
struct Drawn {
  Point point;
  std::vector<DrawnNumber> numbers = {};
  int n_experiments = 0;
  ForceErrors forces = {};          ///< flat: over all experiments
  double error_over_predicted = 0;  ///< root mean square over the numbers
  double by_chance = 0;             ///< standard deviation that it would have by chance, were it 1
};
/// Set the last two.
void sum_up(Drawn& drawn);

/// By gel, density, noise.
std::vector<Point> points_of(const Asked& asked);
Gel with_modulus(Gel gel, double youngs_modulus_kPa);
double median_area_um2(const std::vector<Adhesion>& adhesions);

/// Three standard errors are the smallest force seen: chance passes it once in 700 times.
constexpr double kSeen = 3;
/// Of estimates of one quantity. @param by_beads_nN  their parts by the noise of the beads; may be empty
template <class Quantity>
ExpectedOf<Quantity> expected_by(const Point& point, Quantity quantity, std::vector<double> errors_nN,
                                 std::vector<double> by_beads_nN, double target_nN) {
  ExpectedOf<Quantity> e{.point = point, .quantity = quantity, .n = static_cast<int>(errors_nN.size())};
  const auto n_within = std::ranges::count_if(errors_nN, [&](double error_nN) { return error_nN <= target_nN; });
  e.standard_error_nN = numerics::median_in(errors_nN);
  if (!by_beads_nN.empty()) e.from_beads_nN = numerics::median_in(by_beads_nN);
  e.target_nN = target_nN;
  e.share_within = static_cast<double>(n_within) / e.n;
  e.smallest_seen_nN = kSeen * e.standard_error_nN;
  return e;
}

/// The densities at which half and nine in ten of the fibres or patches meet the target.
/// @param densities  at which each does; infinite: at none
Needed needed_by(double youngs_modulus_kPa, double noise_um, std::vector<double> densities);

/// Gels on which the cell is hardly seen, or strained beyond linear elasticity. @param quantity  one of the grid
template <class Quantity>
std::vector<std::string> warnings_of(const Asked& asked, const GridOf<Quantity>& grid, Quantity quantity);

}  // namespace mbtfm::plan
