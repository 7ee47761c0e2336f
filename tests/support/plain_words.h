/// Words that people whose language is another one trip over, and that no page needs (CONTRIBUTING.md, "Plain words").
#pragma once

#include <regex>

#include "tests/support/test.h"

namespace mbtfm::test {

/// Each has a plainer word for all of its uses: "rewritten", "missing", "reports", "is in", "ran out", "usually", "if".
inline constexpr std::array kUnplain = {
    R"(\banew\b)",       R"(\black(s|ed|ing)?\b)", R"(\btells\b)",
    R"(\bstands? in\b)", R"(\bwant of\b)",         R"(\bas a rule\b)",
    R"(\bon where\b)",   R"(\blikewise\b)",        R"((^|[.!?] )(\*\*)?Where (an?|the|no|nothing|it|both|one)\b)"};

/// What of a text is found, as "the pattern: the words around it".
inline std::vector<std::string> unplain_words_in(const std::string& text) {
  std::vector<std::string> found;
  for (const char* pattern : kUnplain) {
    const std::regex word(pattern);
    for (std::sregex_iterator at(text.begin(), text.end(), word), end; at != end; ++at) {
      const auto place = static_cast<std::size_t>(at->position());
      found.push_back(std::string(pattern) + ": " + text.substr(place < 40 ? 0 : place - 40, 100));
    }
  }
  return found;
}

/// The lines of a page in Markdown that are sentences or rows: no code, no titles, no heads of tables.
inline std::vector<std::string> lines_of_prose(const std::string& page) {
  std::istringstream stream(page);
  std::vector<std::string> all, prose;
  for (std::string line; std::getline(stream, line);) all.push_back(line);
  bool is_code = false;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool is_fence = all[i].find("```") != std::string::npos;
    if (is_fence) is_code = !is_code;
    const bool is_head = i + 1 < all.size() && all[i + 1].starts_with("|---");
    if (is_code || is_fence || is_head || all[i].starts_with("#")) continue;
    prose.push_back(std::regex_replace(all[i], std::regex("`[^`]*`"), "code"));
  }
  return prose;
}

}  // namespace mbtfm::test
