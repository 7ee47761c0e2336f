/// What records say of where and when a program ran.
#pragma once

#include <string>

namespace mbtfm::numerics {

/// The processor's name as the system has it ("AMD EPYC 7B13"); the architecture where it has none.
std::string processor_name();

/// The time now, UTC, as ISO 8601 has it: 2026-01-31T23:59:58Z.
std::string utc_now();

}  // namespace mbtfm::numerics
