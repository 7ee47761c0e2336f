/// The knobs that trade accuracy for time, and the rungs of each.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/runner/settings.h"

namespace mbtfm::cost {

/// One choice of one knob; everything else is as the cell has it.
struct Rung {
  std::string knob, value;
  std::vector<runner::Setting> settings = {};
  double bead_share = 1;            ///< of the beads that are used
  std::optional<int> threads = {};  ///< or as many as the study has
};

/// Whether it needs the cell's images: it turns a knob of segmentation or tracking.
bool needs_images(const Rung& rung);

enum class Extent { quick, whole };  ///< whole: those that take minutes, too

inline constexpr const char* kAsItIs = "as it is";
inline constexpr const char* kPreset = "preset";

/// The cell as it is comes first, then knob by knob, rungs from coarse to fine.
std::vector<Rung> ladder(Extent extent);

/// The group of knobs that are drawn together: "gel", "network and meshes", "equilibrium and fit", or the rest.
std::string group_of(const std::string& knob);

}  // namespace mbtfm::cost
