/// The knobs that trade accuracy for time, and the rungs of each.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/cell_kind.h"
#include "pipeline/runner/stages.h"

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
/// The same of a cell in space. @param spacing_um  of its lattice of tractions, which the rungs widen and narrow
std::vector<Rung> ladder_in_space(Extent extent, double spacing_um);

/// The groups of knobs that are drawn together, of one kind of cells.
std::vector<std::string> groups_of(CellKind kind);
/// The one of a knob.
std::string group_of(const std::string& knob, CellKind kind);

}  // namespace mbtfm::cost
