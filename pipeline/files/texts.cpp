#include "pipeline/files/texts.h"

#include <cctype>
#include <sstream>
#include <stdexcept>

namespace mbtfm::files {
namespace {

/// Runs of digits as `#`. @param last  the last of them
std::string with_marks(const std::string& key, std::string& last) {
  std::string marked;
  for (const char c : key) {
    if (std::isdigit(static_cast<unsigned char>(c)) == 0) {
      marked += c;
      continue;
    }
    if (marked.empty() || marked.back() != '#') {
      marked += '#';
      last.clear();
    }
    last += c;
  }
  return marked;
}

}  // namespace

Texts::Texts(std::string_view file) {
  std::istringstream lines{std::string(file)};
  std::string section;
  std::string* open = nullptr;
  const auto begin = [&](const std::string& key, const std::string& text) {
    const auto [entry, is_new] = all_.try_emplace({section, key}, text);
    if (!is_new) throw std::logic_error("[" + section + "] " + key + " comes twice");
    open = &entry->second;
  };
  for (std::string line; std::getline(lines, line);) {
    const std::size_t first = line.find_first_not_of(' '), end = line.find(line.starts_with('[') ? "]" : ": ");
    if (first == line.npos || line[first] == '#') continue;
    if (first > 0 && open) {
      *open += ' ' + line.substr(first);
    } else if (first > 0 || end == line.npos) {
      throw std::logic_error("neither [section] nor key: text: '" + line + "'");
    } else if (line.starts_with('[')) {
      section = line.substr(1, end - 1);
      begin("", end + 2 < line.size() ? line.substr(end + 2) : "");
    } else {
      begin(line.substr(0, end), line.substr(end + 2));
    }
  }
}

std::optional<std::string> Texts::find(const std::string& section, const std::string& key) const {
  if (const auto exact = all_.find({section, key}); exact != all_.end()) return exact->second;
  std::string number;
  const auto marked = all_.find({section, with_marks(key, number)});
  if (marked == all_.end()) return std::nullopt;
  std::string text = marked->second;
  if (const std::size_t at = text.find('#'); at != text.npos) text.replace(at, 1, number);
  return text;
}

std::string Texts::at(const std::string& section, const std::string& key) const {
  if (auto text = find(section, key)) return *std::move(text);
  throw std::logic_error("no text for [" + section + "] " + key);
}

}  // namespace mbtfm::files
