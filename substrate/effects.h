/// The gel's effects, and which a model takes into account.
#pragma once

#include <vector>

#include "substrate/compliance.h"

namespace mbtfm::substrate {

/// In this order: finite thickness, finite sides, depth-graded gel, vertical displacement, uneven surface, large
/// strain.
struct GelEffects {
  Effect thickness, sides, grading, vertical, surface, strain;
  std::vector<Effect> list() const { return {thickness, sides, grading, vertical, surface, strain}; }
};

/// What the named model takes into account. @throws UsageError where a switch asks for something else
GelEffects effects_of_model(const SubstrateParameters& parameters, const Capabilities& can);

/// @throws UsageError "effects.<message>" where it does not hold
void require_of_effects(bool holds, const std::string& message);
/// A switch that is on needs its datum. @throws UsageError
void check_data(const SubstrateParameters& parameters);

/// Parameters without the data of effects that are off: sides far away, an even modulus.
SubstrateParameters without_what_is_off(SubstrateParameters parameters, const GelEffects& effects);

}  // namespace mbtfm::substrate
