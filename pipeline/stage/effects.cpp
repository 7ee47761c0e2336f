#include "pipeline/stage/effects.h"

#include <algorithm>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::stage {
namespace {

struct Key {
  std::string name;
  Switch EffectSwitches::*member;
  std::string meaning;
};

const std::vector<Key>& switches() {
  using S = EffectSwitches;
  static const std::vector<Key> list = {
      {"stress_fibres", &S::stress_fibres, "stress fibres in the network; auto: if any was found"},
      {"finite_thickness", &S::finite_thickness, "the rigid base below the gel; auto: if it changes the displacements"},
      {"finite_sides", &S::finite_sides,
       "the gel's sides, at substrate.side_distance_um; auto: if they change the displacements"},
      {"depth_graded_gel", &S::depth_graded_gel,
       "a modulus that changes with depth, as in substrate.modulus_profile; auto: if it does"},
      {"vertical_displacement", &S::vertical_displacement,
       "displacement into the gel; auto: if a three-dimensional surface is written"},
      {"large_strain", &S::large_strain,
       "strains that are too large for small-strain theory; auto: if material = neo-hooke and the tractions are large "
       "enough"},
      {"drift_affine", &S::drift_affine,
       "correct turn, growth and shear of the stressed image; auto: if the beads at rest show them"},
      {"common_motion", &S::common_motion,
       "fit shift, turn, growth and shear of all beads, too; auto: on, if the beads allow it"},
      {"beads_under_load", &S::beads_under_load, "use the beads' positions under load; auto: if they fit better"},
      {"channel_shift", &S::channel_shift,
       "fit shift and turn of the cell against the beads, too; auto: on, if the beads determine it"},
      {"beyond_cut", &S::beyond_cut, "forces beyond the image and of other cells; auto: if there are any"},
      {"cable_elasticity", &S::cable_elasticity, "cables resist stretch; auto: if any would be longer than at rest"},
      {"robust_loss", &S::robust_loss, "downweight outliers; auto: if they cost more accuracy than this loss does"},
      {"time_coupling", &S::time_coupling, "start from the tensions of the frame before; auto: if there is one"},
  };
  return list;
}

constexpr const char* kTolerance = "effect_tolerance";

}  // namespace

std::vector<std::string> effect_keys() {
  std::vector<std::string> keys;
  for (const Key& key : switches()) keys.push_back(key.name);
  keys.emplace_back(kTolerance);
  return keys;
}

void declare(ParameterList& list, EffectSwitches& values, const std::vector<std::string>& names) {
  list.table("effects");
  const auto is_named = [&](const std::string& name) { return std::ranges::find(names, name) != names.end(); };
  for (const Key& key : switches())
    if (is_named(key.name)) list.add(key.name, values.*key.member, key.meaning);
  if (!is_named(kTolerance)) return;
  list.add(kTolerance, values.effect_tolerance, Range{.low = 0, .high = 1, .excludes_low = true},
           "with auto, an effect that changes the displacement by less than this share is left out");
}

Effect decided(EffectKind kind, Switch setting, double number, double threshold, const std::string& found) {
  const bool is_above = number > threshold;
  Effect effect = decided(kind, setting, is_above,
                          found + " " + brief(number) + (is_above ? ", above " : ", not above ") + brief(threshold));
  effect.number = number;
  effect.threshold = threshold;
  return effect;
}

Effect decided(EffectKind kind, Switch setting, bool is_called_for, const std::string& why) {
  return {.kind = kind,
          .setting = setting,
          .is_on = setting == Switch::automatic ? is_called_for : setting == Switch::on,
          .why = why};
}

std::string line_of(const Effect& effect) {
  std::string line = name_of(effect.kind) + std::string(": ") + (effect.is_on ? "on" : "off");
  line += effect.setting == Switch::automatic ? " (auto)" : " (as switched)";
  line += ": " + effect.why;
  if (effect.seconds > 0) line += "; " + brief(effect.seconds) + " s";
  if (!effect.would_change.empty()) line += "; on, it " + effect.would_change;
  return line;
}

}  // namespace mbtfm::stage
