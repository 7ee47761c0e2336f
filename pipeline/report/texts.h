/// The sentences of pages are data: texts.txt.
#pragma once

#include <fmt/format.h>

#include <string>

namespace mbtfm::report {

/// @param name  "page.key" of texts.txt
/// @throws std::logic_error if there is no such text
std::string text_of(const std::string& name);

/// Its {} are filled as by fmt::format.
template <class... Values>
std::string sentence(const char* name, const Values&... values) {
  return fmt::vformat(text_of(name), fmt::make_format_args(values...));
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
