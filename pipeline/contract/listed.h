#pragma once

#include <string>
#include <type_traits>

namespace mbtfm {

/// "a, b, c"
template <class Texts>
std::string listed(const Texts& texts) {
  std::string list;
  for (const auto& text : texts) {
    if (!list.empty()) list += ", ";
    if constexpr (std::is_integral_v<std::remove_cvref_t<decltype(text)>>)
      list += std::to_string(text);
    else
      list += text;
  }
  return list;
}

}  // namespace mbtfm
