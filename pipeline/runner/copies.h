/// Folders that were copied are no further cells.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm::runner {

/// What distinguishes a cell from all others: the beads' field that it was found from, and where it lies in it.
struct CellInField {
  std::string field_sha256;  ///< empty: there is none, and it is no copy
  Polygon outline_um = {};   ///< empty: not known; it is the whole field then
};

/// For each the first one before it with the same field and an outline that overlaps its own; none if there is none.
/// Two cells of one picture share the field, and lie beside each other.
std::vector<std::optional<std::size_t>> originals_of(const std::vector<CellInField>& cells);

/// Of a message: "the same cell as b/cell 2: their 2_track/displacement.csv are the same bytes …"
std::string why_a_copy(const std::string& original, const std::string& field, const CellInField& cell);

}  // namespace mbtfm::runner
