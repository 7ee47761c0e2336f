#pragma once

#include <string>

namespace mbtfm {

/// "a, b, c"
template <class Texts>
std::string listed(const Texts& texts) {
  std::string list;
  for (const auto& text : texts) {
    if (!list.empty()) list += ", ";
    list += text;
  }
  return list;
}

}  // namespace mbtfm
