/// Named figures, as records have them.
#pragma once

#include <cstdint>
#include <string>
#include <utility>
#include <variant>
#include <vector>

namespace mbtfm {

using Value =
    std::variant<bool, std::int64_t, double, std::string, std::vector<std::int64_t>, std::vector<std::string>>;
/// In the order they were added.
using Figures = std::vector<std::pair<std::string, Value>>;

}  // namespace mbtfm
