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

/// Write batch.csv (docs/columns.md), with a column for every figure that a stage of any of the cells reports.
/// @throws OutputError
void write_batch_table(const std::filesystem::path& file, const std::filesystem::path& folder,
                       const std::vector<BatchCell>& cells, const std::vector<std::string>& only);

/// The cells that failed, for people: a line each with the stage, how it ended, and why. Empty where none did.
std::string failure_table(const std::filesystem::path& folder, const std::vector<BatchCell>& cells);

/// The part of docs/columns.md.
std::string pages_of_tables();

}  // namespace mbtfm::runner
