#pragma once

#include <charconv>
#include <optional>
#include <string_view>

namespace mbtfm {

/// The number that a text is, from its first character to its last; none where it is none, or beyond what fits.
template <class Number>
std::optional<Number> parsed(std::string_view text) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(value) : std::nullopt;
}

}  // namespace mbtfm
