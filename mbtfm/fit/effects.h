/// The effects of the fit as one table: how each is switched and decided, what a fit that had it would change, and how
/// that is reported. The parameters, the fit, `--explain` and the report walk it.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "mbtfm/tensions/effects.h"

namespace mbtfm::fit {

struct FittedCell;

struct EffectRow {
  EffectKind kind;
  std::string_view key;  ///< its switch in [effects]; empty: it has none
  Effect (*decided)(const FittedCell&);
  /// Of the tensions, were it on. Null: it cannot change them, or no datum shows it.
  std::optional<tensions::Change> (*change)(const FittedCell&, const Effect&, int threads) = nullptr;
  std::string_view without_change = "would change nothing that the data show";
};
/// In the order of reports.
const std::vector<EffectRow>& table_of_effects();

/// Keys of [effects] that the fit has.
std::vector<std::string> effect_keys();

/// What became of each.
std::vector<Effect> effects_of(const FittedCell& cell);

/// Each effect that is off with what it would change, in its `change` and `would_change`, and the changes by tension.
struct Explained {
  std::vector<Effect> effects;
  std::vector<tensions::Change> changes;
};
Explained explain(std::vector<Effect> effects, const FittedCell& cell, int threads);

}  // namespace mbtfm::fit
