/// What a user says of the cells of a study: their condition, and which must not enter.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/path.h"

namespace mbtfm::statistics {

struct CellNote {
  std::string condition = {};          ///< empty where none are asked for
  std::string replicate = {};          ///< day, dish or animal; empty where none are told
  std::string reason_to_exclude = {};  ///< empty: it enters
};

struct CellNotes {
  std::vector<CellNote> of_cells;
  std::vector<std::string> warnings = {};  ///< sentences on what was taken for the same
};

/// A cell that is not in the table does not enter. The table is read as people write it (foreign_table.h). Conditions
/// and replicates that differ in capitals alone are one, spelled as it is first.
/// @param names  folders of the cells, relative to the study's
/// @param condition_from, replicate_from  see StudyParameters; empty: the table's column `condition`; `replicate`, else
///                                        `day`, where it has one
/// @throws InputError where a cell has no such folder above it, the table no such column, or a row no cell
CellNotes notes_of(const std::vector<std::string>& names, const std::string& condition_from,
                   const std::string& replicate_from, const std::optional<Path>& table);

}  // namespace mbtfm::statistics
