/// Cells on gels that are not flat, with exact fields: the scenes of chapter 2 of Soiné's thesis (2014).
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "pipeline/contract/beads_in_space.h"
#include "pipeline/contract/gel.h"
#include "pipeline/contract/surface.h"
#include "pipeline/contract/work.h"
#include "pipeline/stage/parameters_fwd.h"
#include "samples/gels/field.h"

namespace mbtfm::gels {

enum class SpaceScene {
  none,             ///< a cell on a flat gel in the plane, as all other scenarios
  patches_on_ring,  ///< a round cell on a flat gel: patches at its edge, a nucleus that pushes (figs. 2.4-2.9)
  wave,             ///< a cell between two crests (figs. 2.11, 2.12)
  groove_edge,      ///< over the edge of a groove (fig. 2.13 B)
  between_grooves,  ///< on the ridge between two grooves (fig. 2.13 A)
  between_waves     ///< in the valley between two steep waves (fig. 2.13 C)
};
constexpr auto words(SpaceScene) {
  return std::array{"none", "patches-on-ring", "wave", "groove-edge", "between-grooves", "between-waves"};
}

struct SpaceParameters {
  SpaceScene scene = SpaceScene::none;
  double traction_kPa = 3;      ///< in the middle of a patch (thesis 2.4)
  double bead_depth_um = 30;    ///< beads lie as deep under the surface
  double axial_noise = 3;       ///< noise along z over that across: what confocal microscopes have
  double outlier_fraction = 0;  ///< of the beads have a random displacement besides the noise (thesis fig. 2.7)
  double outlier_box_um = 10;   ///< side of the box it is drawn from
  int surface_beads = 0;        ///< of another colour, on the surface
  double z_step_um = 0.5;       ///< of the slices
  double numerical_aperture = 0.9;
  double gel_index = 1.36;         ///< polyacrylamide; PDMS has 1.41
  double immersion_index = 1.333;  ///< water
  double peak_photons = 150;       ///< of a bead in focus
  double bleached = 0.1;           ///< share of the light lost over a stack
  double slice_drift_um = 0;       ///< of the stage from slice to slice, standard deviation of its steps
};
void declare(stage::ParameterList& list, SpaceParameters& parameters);

/// Where a cell pulls.
struct Patch {
  Vec3 centre_um;  ///< on the surface
  double radius_um = 0;
  Vec3 aimed_nN;  ///< the force that the bump (1 - r²/a²)² has
  Vec3 force_nN;  ///< the exact one, through the surface within a lateral distance of 1.5 radii
};

struct TractionSample {
  Vec3 place_um, normal, traction_kPa;  ///< normal: out of the gel
};

struct GelScene {
  std::function<double(Vec2)> height_um;
  double field_um = 0;  ///< side of the square field of view
  Gel gel;
  std::vector<FieldUnderASurface::Source> sources;
  std::vector<Patch> patches;
  std::vector<TractionSample> surface;  ///< on a lattice of 2.5 um over the field
  std::vector<BeadInSpace> truth;       ///< without noise
  std::vector<BeadInSpace> measured;    ///< with noise and outliers
  std::vector<Vec3> surface_beads_um;
  double largest_displacement_um = 0, noise_um = 0;
  double share_beside_patches = 0;  ///< of the traction's square that the bumps do not hold
  FieldUnderASurface exact() const { return {sources, gel.youngs_modulus_kPa, gel.poisson_ratio, gel.thickness_um}; }
};

/// Its surface over the field.
HeightMap map_of(const GelScene& scene);

/// What is common to all scenarios.
struct SceneSize {
  double field_um = 0;
  int n_beads = 0;
  double noise = 0;
  std::uint64_t seed = 1;
  Gel gel;
};

/// Patches on the surface pull with bumps of traction; point forces over the surface are fitted to them so that forces
/// and moments vanish exactly. Truth is the field of these forces, which is exact for any surface: no mesh, and none of
/// the programs that reconstruct, have a part in it.
/// @throws UsageError where the scene does not fit the field or the gel
GelScene simulate(const SpaceParameters& parameters, const SceneSize& size, int threads, const Progress& progress = {});

}  // namespace mbtfm::gels
