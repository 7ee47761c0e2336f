/// Lines of the catalogue of hard cases (docs/developers/hard-cases.md), recorded with a test's result.
#pragma once

#include "tests/support/test.h"

namespace mbtfm::test {

/// @param physics   what makes it hard
/// @param expected  what must come out: the right answer within a bound, or which error
inline void hard_case(const std::string& physics, const std::string& expected) {
  ::testing::Test::RecordProperty("physics", physics);
  ::testing::Test::RecordProperty("expected", expected);
}

/// What was measured, for people; the test's expectations judge it. The last call counts.
inline void came_out(const std::string& measured) { ::testing::Test::RecordProperty("measured", measured); }

/// Two significant digits.
inline std::string two_digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", value);
  return text;
}

}  // namespace mbtfm::test
