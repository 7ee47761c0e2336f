/// Numbers as text.
#pragma once

#include <string>

namespace mbtfm {

/// Shortest text that reads back as the same number.
std::string shortest(double value);

/// Three significant digits, for people.
std::string brief(double value);

}  // namespace mbtfm
