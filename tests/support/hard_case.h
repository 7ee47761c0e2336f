/// What came out of the hard cases of notes/hard-cases.md, recorded with a test's result.
#pragma once

#include "tests/support/test.h"

namespace mbtfm::test {

/// What was measured, for people; the test's expectations judge it. The last call counts.
inline void came_out(const std::string& measured) { ::testing::Test::RecordProperty("measured", measured); }

/// Two significant digits.
inline std::string two_digits(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", value);
  return text;
}

}  // namespace mbtfm::test
