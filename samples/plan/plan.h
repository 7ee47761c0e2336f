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
  network_force,
  total_force,
  adhesion_force,
  free_force,
  fttc_force
};
constexpr auto words(Quantity) {
  return std::array{
      "fibre",         "dorsal fibre", "transverse arc", "ventral fibre",        "edge fibre",
      "network force", "total force",  "adhesion force", "adhesion force alone", "adhesion force by FTTC"};
}
inline constexpr Quantity kOfTypes[] = {Quantity::dorsal, Quantity::arc, Quantity::ventral,
                                        Quantity::edge};  ///< in the order of kFibreTypes
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
  std::optional<double> least_distance_um = {};  ///< of two adhesions whose forces are told apart where neither network
                                                 ///< nor background pulls; none: they never are
  double degrees = 0;                            ///< in space: how many numbers the beads tell
  double largest_displacement_um = 0;
  double left_out = 0;  ///< of the displacement, by linear elasticity
};
using Expected = ExpectedOf<Quantity>;
using SpaceExpected = ExpectedOf<SpaceQuantity>;

/// What a cell on a gel needs. No less than the least density that was asked for: few beads tell less than the law has
/// it.
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

struct Asked;
/// By gel, density, noise.
std::vector<Point> points_of(const Asked& asked);
Gel with_modulus(Gel gel, double youngs_modulus_kPa);
double median_area_um2(const std::vector<Adhesion>& adhesions);

/// Three standard errors are the smallest force seen: chance passes it once in 700 times.
constexpr double kSeen = 3;
/// Of errors, those that are the target or less.
double share_within(const std::vector<double>& errors_nN, double target_nN);
/// The density at which this share of fibres or patches meets the target; none if that is infinite.
/// @param needed  of each; infinite: none
std::optional<double> density_of_share(std::vector<double> needed, double share);

constexpr double kOfNoise = 3;          ///< a largest displacement below so many times the noise is hardly seen
constexpr double kBeyondLinear = 0.05;  ///< as the caution large-strain of the fit
std::string sentence_of_noise(double youngs_modulus_kPa, double largest_um, double noise_um);
std::string sentence_of_strain(double youngs_modulus_kPa, double left_out);

}  // namespace mbtfm::plan
