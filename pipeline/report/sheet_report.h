/// The page of a cell or colony that is fitted as a contracting sheet.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pipeline/report/stage_page.h"

namespace mbtfm::report {

/// @throws InputError where a file that the stages write lacks or is malformed
std::string report_of_sheet(const std::filesystem::path& cell);

/// The tables of a fit, for pages. @param of  put before the names under which they are downloaded
std::vector<Listing> tables_of_sheet(const std::filesystem::path& estimates, const std::filesystem::path& models,
                                     const std::string& of = {});

/// "contraction 1.8 nN/µm (1.7 to 1.9); stiffness 3.1 nN/µm (2.6 to 3.8); mean tension 1.1 nN/µm; total force 540 nN"
std::string result_line_of_sheet(const std::filesystem::path& cell);
/// The same as an event (docs/formats.md).
std::string result_event_of_sheet(const std::filesystem::path& cell, const std::filesystem::path& report);

}  // namespace mbtfm::report
