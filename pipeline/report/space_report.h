/// The page of a cell whose beads are in space.
#pragma once

#include <filesystem>
#include <string>

#include "pipeline/report/provenance.h"

namespace mbtfm::report {

/// @throws InputError where a file that the stages write lacks or is malformed
std::string report_in_space(const std::filesystem::path& cell);

/// "total force 820 nN; net force 12 ± 30 nN; strain energy 160 fJ"
std::string result_line_in_space(const std::filesystem::path& cell);
/// The same as an event (docs/formats.md).
std::string result_event_in_space(const std::filesystem::path& cell, const std::filesystem::path& report);

/// Stages, effects, parameters. @param figures  HTML, of the last stage
std::string provenance_section(const Provenance& provenance, const std::string& figures);

}  // namespace mbtfm::report
