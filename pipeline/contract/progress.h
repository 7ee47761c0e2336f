#pragma once

#include <functional>
#include <string_view>

namespace mbtfm {

/// Told how far a long work has come (0 to 1) and with what; may throw to cancel. May be empty.
using Progress = std::function<void(double fraction, std::string_view what)>;

}  // namespace mbtfm
