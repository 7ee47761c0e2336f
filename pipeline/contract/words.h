/// A choice of a few words is an enum class. Its words are beside it, once, in its order:
///
///   enum class Loss { squares, huber };
///   constexpr auto words(Loss) { return std::array{"squares", "huber"}; }
///
/// Flags, cell.toml, --help, the pages of the docs, records and errors take them from there.
#pragma once

#include <algorithm>
#include <array>
#include <optional>
#include <string_view>
#include <type_traits>
#include <vector>

namespace mbtfm {

template <class E>
concept Worded = std::is_enum_v<E> && requires(E value) {
  words(value).size();
};

template <Worded E>
constexpr const char* name_of(E value) {
  return words(value).at(static_cast<std::size_t>(value));
}

/// All values, in their order.
template <Worded E>
std::vector<E> values_of() {
  std::vector<E> values(words(E{}).size());
  for (std::size_t k = 0; k < values.size(); ++k) values[k] = static_cast<E>(k);
  return values;
}

/// The value that this word means, if any.
template <Worded E>
constexpr std::optional<E> named(std::string_view word) {
  const auto all = words(E{});
  const auto found = std::find(all.begin(), all.end(), word);
  if (found == all.end()) return std::nullopt;
  return static_cast<E>(found - all.begin());
}

/// Whether to do what a scene may or may not call for; automatic: as the scene has it.
enum class Switch { automatic, on, off };
constexpr auto words(Switch) { return std::array{"auto", "on", "off"}; }
/// Where it is said, whether the scene calls for it or not.
constexpr Switch switched(bool is_on) { return is_on ? Switch::on : Switch::off; }

}  // namespace mbtfm
