/// What kinds of cells there are: each has its own stages and its own report.
#pragma once

#include <array>

#include "pipeline/contract/words.h"

namespace mbtfm {

/// Where a cell's beads are followed, and what pulls at them.
enum class CellKind {
  plane,  ///< on a flat gel, by fibres: segment, track, network, fit
  space,  ///< in the volume of a gel, which may be curved: segment where there are images of the cell, track, surface,
          ///< traction
  sheet   ///< on a flat gel, by a contracting sheet: segment where there are images of the cell, track, sheet
};
constexpr auto words(CellKind) { return std::array{"plane", "space", "sheet"}; }

/// What a kind is made of: decisions ask for one of these, not for the kind, so that a further one (fibres on a curved
/// gel) is a row here and in the tables of runner, report and statistics.
struct CellTraits {
  bool has_fibres;   ///< whose tensions are fitted
  bool is_sheet;     ///< that contracts; neither: tractions alone
  bool is_in_space;  ///< beads in the volume of a gel; else on a plane
  const char *one, *many;
};
inline constexpr std::array<CellTraits, 3> kCellTraits = {
    {{true, false, false, "cell", "cells"},
     {false, false, true, "cell in space", "cells in space"},
     {false, true, false, "sheet", "sheets"}}};  // in the order of CellKind
constexpr const CellTraits& traits_of(CellKind kind) { return kCellTraits.at(static_cast<std::size_t>(kind)); }
constexpr bool has_fibres(CellKind kind) { return traits_of(kind).has_fibres; }
constexpr bool is_sheet(CellKind kind) { return traits_of(kind).is_sheet; }
constexpr bool is_in_space(CellKind kind) { return traits_of(kind).is_in_space; }

}  // namespace mbtfm
