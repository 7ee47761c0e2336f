/// What a batch found, cell by cell.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/runner/batch.h"

namespace mbtfm::runner {

/// What the last of the cell's stages that is done has to say: "170 adhesions, 20 fibres (…)"; empty where none is.
/// @param only  of these stages; empty: of all
std::string last_summary(const std::filesystem::path& cell, const std::vector<std::string>& only);

/// What became of a cell that was run: "fine", "with cautions (cell-cut)", "NOT USABLE (misfit)".
std::string verdict_on(const std::filesystem::path& cell, const std::vector<std::string>& only);

/// What the last lines of a batch say.
struct BatchCounts {
  std::string counts;        ///< "9 done: 6 fine, 2 with cautions, 1 not usable; 3 failed"
  std::string not_to_count;  ///< a line for each copy and each cell that is not usable, with the reason
};

/// Write FOLDER/batch.csv, a row for each cell and each folder that seems to be one, and batch_all.csv with every
/// figure that a stage of any of the cells reports (docs/columns.md). Cells that are copies of others are named as
/// such.
/// @throws OutputError
BatchCounts write_batch_tables(const std::filesystem::path& folder, const std::vector<BatchCell>& cells,
                               const std::vector<SkippedFolder>& skipped, const std::vector<std::string>& only);

/// The cells that failed, for people: a line each with the stage, how it ended, and why. Empty where none did.
std::string failure_table(const std::filesystem::path& folder, const std::vector<BatchCell>& cells);

/// The part of docs/columns.md.
std::string pages_of_tables();

}  // namespace mbtfm::runner
