/// Which of the gel's effects a scene calls for.
#pragma once

#include "substrate/effects.h"

namespace mbtfm::choice {

/// What decides besides the gel itself; zero where there is no scene yet.
struct SceneSize {
  double width_um = 0;            ///< diagonal of the rectangle around all adhesions and points
  double adhesion_radius_um = 0;  ///< mean over the adhesions of the radius of a disc of the same area
};

/// By the switches and, where these are `auto`, by what each would change of the field (docs/theory/substrate.md):
///
/// - finite thickness: the layer's correction s_0/(2 pi mu h) is largest, and even, near the force, while the field
///   falls as 1/r. Over a disc of radius R around a force, R >> a, its share of the field's L2 norm is at most
///   2 s_0 / sqrt((2-nu)² + nu²) · R/h (the field's norm, as sqrt(2 ln(R/a)), being taken as that at R = e^(1/2) a: an
///   upper bound for a scene larger than its adhesions).
/// - finite sides at a distance d: the layer's field falls as exp(-0.739 r/h) or faster, to a side and back
///   exp(-1.48 d/h).
/// - depth-graded gel: stiffer everywhere is less compliant, so the true compliance lies between those of the softest
///   and the stiffest depth: it differs from the even gel's by E/E_min - 1 or 1 - E/E_max at most.
/// - vertical displacement: it does not act back on the displacement along the surface: on only where it is asked for.
/// - uneven surface: seen from above, a tilt by alpha shortens what is along it by cos(alpha). A force at a height eta
///   over the mean surface adds the couple eta F, as two vertical forces would: on a half-space its field along the
///   surface is (1-2 nu)/(2-2 nu) eta/r of the force's own (Boussinesq), so by the same norm at most eta/a. No model
///   has it: never on, but its number says whether that matters.
/// - large strain: where no force is known yet, only where its switch is on; else see large_strain.h.
/// @throws UsageError where a switch is on that the gel has no datum for, or the switches contradict each other
substrate::GelEffects decide(const Gel& gel, const substrate::SubstrateParameters& parameters, const SceneSize& scene);

}  // namespace mbtfm::choice
