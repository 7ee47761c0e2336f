/// What a user says of a reconstruction in space.
#pragma once

#include <optional>

#include "mbtfm/inverse/loss.h"
#include "pipeline/contract/words.h"
#include "pipeline/stage/parameters_fwd.h"

namespace mbtfm::spatial {

/// Where tractions are looked for; outside of it only `background` of them are expected.
enum class Region {
  automatic,  ///< the outline where there is one, else all
  all,        ///< wherever there are beads
  outline,    ///< the cell, grown by two distances of beads
  adhesions   ///< their ellipses, grown
};
constexpr auto words(Region) { return std::array{"auto", "all", "outline", "adhesions"}; }

/// What the misfit of a bead costs. Of the length of its residual over its errors, so that no axis is special; but for
/// the last.
enum class BeadLoss { l2, mixture, l1, huber, biweight, l1_by_component };
constexpr auto words(BeadLoss) { return std::array{"l2", "mixture", "l1", "huber", "biweight", "l1-by-component"}; }
/// Of its weights by the residual; squares where they are not by that.
constexpr inverse::Loss shape_of(BeadLoss loss) {
  using enum inverse::Loss;
  return std::array{squares, squares, l1, huber, tukey, l1}.at(static_cast<std::size_t>(loss));
}

/// Where the faces on which tractions are bilinear are smaller.
enum class Refine {
  none,      ///< all alike
  region,    ///< where the cell pulls
  resolved,  ///< begun twice as large, split where the beads resolve more and tractions exceed their errors
  threshold  ///< begun twice as large, split where tractions are largest (thesis 2.3.3)
};
constexpr auto words(Refine) { return std::array{"none", "region", "resolved", "threshold"}; }
constexpr bool starts_coarse(Refine refine) { return refine == Refine::resolved || refine == Refine::threshold; }

struct SpatialParameters {
  /// Of the lattice of tractions, over the distance of the beads: the beads resolve no finer tractions; at
  /// their distance the lattice itself would be felt.
  double spacing_beads = 0.83;
  Region region = Region::automatic;
  Refine refine = Refine::none;  ///< errors of all methods were measured so
  double background = 0.1;       ///< a tenth: a patch left out is seen, noise far from the cell is not
  BeadLoss loss = BeadLoss::l2;
  double axial_sigma_ratio = 3;  ///< of confocal stacks (thesis 2.3.2)
  bool with_axial = true;        ///< displacement along z counts
};
void declare(stage::ParameterList& list, SpatialParameters& parameters);

}  // namespace mbtfm::spatial
