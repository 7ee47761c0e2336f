/// Standard errors of tractions in space over gels, densities and noises, and what it takes to reach a target.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mbtfm/plan/adhesion_pair.h"
#include "mbtfm/plan/space_scene.h"
#include "mbtfm/spatial/foresight.h"
#include "pipeline/contract/work.h"

namespace mbtfm::plan {

struct SpacePoint {
  double youngs_modulus_kPa = 0, beads_per_um3 = 0, noise_um = 0;
};

/// What is estimated. Of patches the plan gives the middle one.
enum class SpaceQuantity { force, tangential_force, normal_force, total_force, net_force };
constexpr auto words(SpaceQuantity) {
  return std::array{"patch force", "patch force along the surface", "patch force normal to it", "total force",
                    "net force"};
}

/// Of a quantity at a point; of several medians.
struct SpaceExpected {
  SpacePoint point;
  SpaceQuantity quantity = SpaceQuantity::force;
  int n = 0;
  double standard_error_nN = 0;
  double from_beads_nN = 0, from_background_nN = 0;
  double target_nN = 0;
  double share_within = 0;  ///< of the n
  double smallest_seen_nN = 0;
  std::optional<double> resolution_um;  ///< at the patches
  std::optional<double>
      least_distance_um;  ///< of two patches that forces on them alone tell apart; none: they never do
  double degrees = 0;     ///< how many numbers the beads tell
  double largest_displacement_um = 0;
  double left_out = 0;  ///< of the displacement, by linear elasticity
};

struct SpaceNeeded {
  double youngs_modulus_kPa = 0, noise_um = 0;
  std::optional<double>
      beads_per_um3;              ///< so that the middle patch meets the target; none: most_beads_per_um3() do not
  std::optional<double> of_most;  ///< the same of nine patches in ten
};

/// The gel's answer to tractions at the places of beads, as many as two draws and the drawn experiments are parts of.
/// One gel stands for all moduli: see spatial::Foresight.
struct SpacePool {
  std::vector<BeadInSpace> beads;  ///< with exact displacements and errors of 1 um across
  spatial::Problem problem;
};
/// By density, each with the lattice of tractions that a reconstruction of so many beads takes, so that what is said of
/// a density does not depend on the others.
std::vector<SpacePool> pools_of(const SpaceScene& scene, const Asked& asked, const Work& work);
/// Beads of the pool, these by number, with this noise over what they state.
spatial::Problem part_of(const SpaceScene& scene, const SpacePool& pool, const std::vector<Eigen::Index>& chosen,
                         double noise, drawing::Random* random);
std::size_t n_beads_of(const SpaceScene& scene, double beads_per_um3);

/// Means over two draws of beads, by density and by noise times modulus.
struct SpaceForeseen {
  std::vector<double> beads_per_um3, noise_kPa_um;
  std::vector<std::vector<spatial::Foreseen>> at;
  const spatial::Foreseen& of(const SpacePoint& point) const;
  std::size_t index_of_density(double beads_per_um3) const;  ///< of the list's nearest
};
SpaceForeseen foresee(const SpaceScene& scene, const Asked& asked, const std::vector<SpacePool>& pools,
                      const Work& work);

struct SpaceGrid {
  std::vector<SpaceExpected> expected;
  std::vector<SpaceNeeded> needed;  ///< by gel, then noise
  std::vector<std::string> warnings;
};
/// The most of which a plan says whether they suffice: four times the densest asked for.
double most_beads_per_um3(const std::vector<double>& densities);
/// Of two patches of the middle size.
PairResolution pairs_of(const SpaceScene& scene, const Asked& asked, const PairDraws& draws, int threads);
SpaceGrid grid_of(const SpaceScene& scene, const Asked& asked, const std::vector<SpacePool>& pools,
                  const SpaceForeseen& foreseen, const PairResolution& pairs);

/// Of a patch: along its force, along the surface as its force goes, along the normal; unit vectors, by column.
Eigen::Matrix3d directions_of(const SpaceScene& scene, const SpacePatch& patch);

}  // namespace mbtfm::plan
