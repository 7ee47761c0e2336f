/// A cell's result in one line, for the terminal and for programs.
#pragma once

#include <string>

#include "pipeline/contract/path.h"

namespace mbtfm::report {

/// "total force 412 ± 21 nN; tensions: ventral 4.1 (8), dorsal 0.7 (7), arc 2.2 nN (5); 3 of 20 uncertain": means by
/// type, how many. @throws InputError where a file of the fit is malformed
std::string result_line(const Path& cell);
/// The same as the members of a JSON object.
std::string result_event(const Path& cell, const Path& report);

}  // namespace mbtfm::report
