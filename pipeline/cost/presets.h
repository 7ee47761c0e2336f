/// Sets of parameters that trade accuracy for time together.
#pragma once

#include <string>
#include <vector>

#include "pipeline/runner/stages.h"

namespace mbtfm::cost {

struct Preset {
  std::string name;
  std::string purpose;
  std::vector<runner::Setting> settings;  ///< where they differ from the defaults, of cells with fibres
  std::vector<runner::Setting> in_space;  ///< the same of cells in space
};

/// The cheapest first.
const std::vector<Preset>& presets();

/// @throws UsageError for an unknown name
const Preset& preset_named(const std::string& name);

}  // namespace mbtfm::cost
