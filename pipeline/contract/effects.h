/// Effects of the physics that a scene may or may not call for, and what became of each in a run.
#pragma once

#include <optional>
#include <string>

#include "pipeline/contract/words.h"

namespace mbtfm {

/// A new kind compiles again only what names kinds: kinds_of_effects.h has the list.
enum class EffectKind : int;

struct Effect {
  EffectKind kind{};
  Switch setting = Switch::automatic;
  bool is_on = false;
  std::optional<double> number = {};  ///< what leaving it out would cost, where that was asked; on above the threshold
  std::optional<double> threshold = {};
  std::string why;
  double seconds = 0;                 ///< spent on it, its own question included
  std::optional<double> change = {};  ///< of the tensions were it on, relative; where that was asked (--explain)
  std::string would_change = {};      ///< the same in a sentence
};

}  // namespace mbtfm
