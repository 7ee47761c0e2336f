#include "pipeline/stage/effects.h"

#include <algorithm>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::stage {
namespace {

struct Key {
  const char* name;
  Switch EffectSwitches::*member;
};
using S = EffectSwitches;
constexpr Key kSwitches[] = {{"stress_fibres", &S::stress_fibres},
                             {"finite_thickness", &S::finite_thickness},
                             {"finite_sides", &S::finite_sides},
                             {"depth_graded_gel", &S::depth_graded_gel},
                             {"vertical_displacement", &S::vertical_displacement},
                             {"large_strain", &S::large_strain},
                             {"drift_affine", &S::drift_affine},
                             {"common_motion", &S::common_motion},
                             {"beads_under_load", &S::beads_under_load},
                             {"channel_shift", &S::channel_shift},
                             {"beyond_cut", &S::beyond_cut},
                             {"cable_elasticity", &S::cable_elasticity},
                             {"robust_loss", &S::robust_loss},
                             {"time_coupling", &S::time_coupling}};

constexpr const char* kTolerance = "effect_tolerance";

}  // namespace

std::vector<std::string> effect_keys() {
  std::vector<std::string> keys;
  for (const Key& key : kSwitches) keys.emplace_back(key.name);
  keys.emplace_back(kTolerance);
  return keys;
}

void declare(ParameterList& list, EffectSwitches& values, const std::vector<std::string>& names) {
  list.table("effects");
  const auto is_named = [&](const std::string& name) { return std::ranges::find(names, name) != names.end(); };
  for (const Key& key : kSwitches)
    if (is_named(key.name)) list.add(key.name, values.*key.member);
  if (!is_named(kTolerance)) return;
  list.add(kTolerance, values.effect_tolerance, Range{.low = 0, .high = 1, .excludes_low = true});
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
