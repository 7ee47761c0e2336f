/// Numbers as text.
#pragma once

#include <string>

namespace mbtfm {

/// Shortest text that reads back as the same number.
std::string shortest(double value);

/// This many significant digits, without zeros at the end.
std::string significant(double value, int digits);

/// Three significant digits, for people; below a million without an exponent.
std::string brief(double value);

}  // namespace mbtfm
