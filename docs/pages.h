/// The pages of docs/ that are made, not written: what the programs declare.
#pragma once

#include <filesystem>
#include <string>

namespace mbtfm::pages {

inline constexpr const char* kMade[] = {"parameters.md", "columns.md", "findings.md", "plausible.md"};

/// What every stage prints for --parameters, after the ten keys that a new user sets.
/// @param programs  folder of the executables
/// @throws std::runtime_error if a program fails, or does not declare one of the ten
std::string parameter_page(const std::filesystem::path& programs);

/// Every table, column by column.
std::string column_page();

/// A page of kMade by its name.
std::string made_page(const std::string& name, const std::filesystem::path& programs);

}  // namespace mbtfm::pages
