/// The page of a cell or colony that is fitted as a contracting sheet.
#pragma once

#include <filesystem>
#include <string>

namespace mbtfm::report {

/// @throws InputError where a file that the stages write lacks or is malformed
std::string report_of_sheet(const std::filesystem::path& cell);

/// "contraction 1.8 (1.7 to 1.9) nN/µm; stiffness 3.1 (2.6 to 3.8) nN/µm; mean tension 1.1 nN/µm; total force 540 nN"
std::string result_line_of_sheet(const std::filesystem::path& cell);
/// The same as an event (docs/formats.md).
std::string result_event_of_sheet(const std::filesystem::path& cell, const std::filesystem::path& report);

}  // namespace mbtfm::report
