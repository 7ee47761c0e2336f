/// Counts as a sentence has them.
#pragma once

#include <cstdint>
#include <string>

namespace mbtfm {

/// "1 density", "2 densities"
inline std::string counted(std::int64_t n, const std::string& one, const std::string& many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

/// "1 sheet", "3 sheets". @param many  a plural in -s
inline std::string counted(std::int64_t n, const std::string& many) {
  return counted(n, many.substr(0, many.size() - 1), many);
}

}  // namespace mbtfm
