/// Do adhesions, fibres and the gel point the same way? Angles between them, at the adhesions (thesis fig. 3.10).
#pragma once

#include <optional>
#include <string_view>
#include <vector>

#include "pipeline/contract/beads.h"
#include "pipeline/contract/cell.h"

namespace mbtfm::statistics {

/// What is compared. Adhesions have an axis: 0° to 90°, by chance 45°. The others have a direction: 0° to 180°, by
/// chance 90°.
enum class Relation { adhesion_fibre, fibre_displacement, model_measured, without_fibres_measured };
inline constexpr Relation kRelations[] = {Relation::adhesion_fibre, Relation::fibre_displacement,
                                          Relation::model_measured, Relation::without_fibres_measured};
constexpr auto words(Relation) {
  return std::array{"adhesion-fibre", "fibre-displacement", "model-measured", "without fibres-measured"};
}
/// For people: "adhesion and fibre".
std::string_view full_name_of(Relation relation);
/// 90 or 180.
double largest_angle_deg(Relation relation);

struct Direction {
  Relation relation = Relation::adhesion_fibre;
  int adhesion_id = 0;
  std::optional<int> fibre_id;
  double angle_deg = 0;
};

/// The beads' displacement, and the model's at the beads that the fit used.
struct Displacements {
  std::optional<DisplacementField> measured, fitted, without_fibres;
  double noise_um = 0;  ///< standard deviation of a component
  double near_um = 0;   ///< of an adhesion's centre
};

/// Fibres begin with the chord of their first 2 um, from the adhesion inwards: about the adhesion's own length. The
/// displacement is the mean over the beads near the adhesion, left out below 2 standard errors, where its direction is
/// that of the noise. Without displacements, the first relation only.
std::vector<Direction> directions_of(const Cell& cell, const Displacements& displacements);

}  // namespace mbtfm::statistics
