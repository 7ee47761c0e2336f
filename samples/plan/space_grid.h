/// Standard errors of tractions in space over gels, densities and noises, and what it takes to reach a target.
#pragma once

#include <vector>

#include "mbtfm/spatial/foresight.h"
#include "pipeline/contract/work.h"
#include "samples/plan/adhesion_pair.h"
#include "samples/plan/plan.h"
#include "samples/plan/scene.h"

namespace mbtfm::plan {

/// The gel's answer to tractions at the places of beads, as many as two draws and the drawn experiments are parts of.
/// One gel represents all moduli: see spatial::Foresight.
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
  const spatial::Foreseen& of(const Point& point) const;
  std::size_t index_of_density(double beads_per_um3) const;  ///< of the list's nearest
};
SpaceForeseen foresee(const SpaceScene& scene, const Asked& asked, const std::vector<SpacePool>& pools,
                      const Work& work);

/// The most of which a plan says whether they suffice: four times the densest asked for.
double most_beads_per_um3(const std::vector<double>& densities);
/// Of two patches of the middle size.
PairResolution pairs_of(const SpaceScene& scene, const Asked& asked, const PairDraws& draws, int threads);
SpaceGrid grid_of(const SpaceScene& scene, const Asked& asked, const std::vector<SpacePool>& pools,
                  const SpaceForeseen& foreseen, const PairResolution& pairs);

/// Of a patch: along its force, along the surface as its force goes, along the normal; unit vectors, by column.
Eigen::Matrix3d patch_directions(const SpaceScene& scene, const SpacePatch& patch);

/// Other beads of the pool, with noise; reconstructed as a cell is.
Drawn draw_experiments(const SpaceScene& scene, const SpacePool& pool, const SpaceForeseen& foreseen,
                       const Point& point, int n_experiments, const Work& work);

}  // namespace mbtfm::plan
