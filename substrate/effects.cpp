#include "substrate/effects.h"

#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "substrate/models.h"

namespace mbtfm::substrate {

void require_of_effects(bool holds, const std::string& message) {
  if (!holds) throw UsageError("effects." + message);
}

void check_data(const SubstrateParameters& p) {
  require_of_effects(p.effects.finite_sides != Switch::on || p.side_distance_um,
                     "finite_sides = on: expected substrate.side_distance_um, where the gel's sides are, found none");
  require_of_effects(p.effects.depth_graded_gel != Switch::on || !p.modulus_profile.empty(),
                     "depth_graded_gel = on: expected substrate.modulus_profile, found none");
  require_of_effects(p.effects.large_strain != Switch::on || p.material == MaterialLaw::neo_hooke,
                     "large_strain = on: expected substrate.material = neo-hooke, found linear");
}

GelEffects effects_of_model(const SubstrateParameters& p, const Capabilities& can) {
  check_data(p);
  const std::string model = name_of(p.model);
  const std::string as_model = "as the model " + model + " has it";
  const auto row = [&](EffectKind kind, const char* key, Switch setting, bool can_on, bool can_off, bool is_on,
                       const std::string& why) {
    require_of_effects(setting != Switch::on || can_on,
                       std::string(key) + " = on: the model '" + model + "' has none: take another, or auto");
    require_of_effects(setting != Switch::off || can_off,
                       std::string(key) + " = off: the model '" + model + "' cannot leave it out");
    return stage::decided(kind, setting, is_on, why);
  };
  const bool is_graded = !p.modulus_profile.empty() && p.effects.depth_graded_gel != Switch::off;
  if (is_graded && !can.grading) {
    throw UsageError("substrate.modulus_profile: the model '" + model +
                     "' holds for one modulus at every depth: take the model refined or auto, or switch "
                     "effects.depth_graded_gel off");
  }
  using enum EffectKind;
  return {
      row(finite_thickness, "finite_thickness", p.effects.finite_thickness, can.base, !can.base, can.base, as_model),
      row(finite_sides, "finite_sides", p.effects.finite_sides, can.sides, true, can.sides && p.side_distance_um,
          as_model),
      row(depth_graded_gel, "depth_graded_gel", p.effects.depth_graded_gel, true, true, is_graded, as_model),
      row(vertical_displacement, "vertical_displacement", p.effects.vertical_displacement, can.normal_displacement,
          true, asks_for_vertical(p), asks_for_vertical(p) ? "asked for" : "not asked for"),
      stage::decided(uneven_surface, Switch::automatic, false, as_model + ": level and smooth"),
      row(large_strain, "large_strain", p.effects.large_strain, can.large_strain, true, false,
          p.effects.large_strain == Switch::on ? "asked for" : "not asked for")};
}

SubstrateParameters without_what_is_off(SubstrateParameters p, const GelEffects& effects) {
  if (!effects.sides.is_on) p.side_distance_um.reset();
  if (!effects.grading.is_on) p.modulus_profile.clear();
  return p;
}

}  // namespace mbtfm::substrate
