/// The sentences of pages are data: texts.txt.
#pragma once

#include <string>
#include <type_traits>
#include <variant>
#include <vector>

namespace mbtfm::report {

/// @param name  "page.key" of texts.txt
/// @throws std::logic_error if there is no such text
std::string text_of(const std::string& name);

using TextValue = std::variant<double, long long, std::string>;
template <class T>
TextValue text_value(const T& value) {
  if constexpr (std::is_integral_v<T>)
    return static_cast<long long>(value);
  else if constexpr (std::is_floating_point_v<T>)
    return static_cast<double>(value);
  else
    return std::string(value);
}
/// Its {} are filled as by fmt::format.
std::string filled(const std::string& name, const std::vector<TextValue>& values);
template <class... Values>
std::string sentence(const char* name, const Values&... values) {
  return filled(name, {text_value(values)...});
}

/// The same as HTML: a paragraph, and a small one.
template <class... Values>
std::string paragraph(const char* name, const Values&... values) {
  return "<p>" + sentence(name, values...) + "</p>\n";
}
template <class... Values>
std::string note(const char* name, const Values&... values) {
  return "<p class=\"sub\">" + sentence(name, values...) + "</p>\n";
}

}  // namespace mbtfm::report
