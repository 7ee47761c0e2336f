/// Settings of studies from their command lines.
#pragma once

#include "pipeline/stage/parameters.h"
#include "tests/support/test.h"

namespace mbtfm::test {

/// @param settings  NAME=VALUE each
/// @throws UsageError for a name that is not declared and for a value out of range
inline void set_all(stage::ParameterList& list, const std::vector<std::string>& settings) {
  for (const std::string& setting : settings) {
    const auto split = setting.find('=');
    stage::set_from_text(stage::parameter_named(list, setting.substr(0, split)),
                         split == std::string::npos ? "" : setting.substr(split + 1));
  }
}

}  // namespace mbtfm::test
