#include "pipeline/files/names.h"

#include <utf8proc.h>

#include <algorithm>
#include <charconv>
#include <cstdlib>
#include <memory>
#include <sstream>

namespace mbtfm::files {

namespace {

std::string bytes_of_shown(std::string_view text) {
  constexpr std::size_t kEscape = 4;       // \xE9
  constexpr unsigned kBeyondAscii = 0x80;  // no other byte is shown so: none makes a name of "..", say
  std::string bytes;
  for (std::size_t i = 0; i < text.size(); ++i) {
    unsigned byte = 0;
    const char* digits = text.data() + i + 2;
    if (text.substr(i).starts_with("\\x") && i + kEscape <= text.size() &&
        std::from_chars(digits, digits + 2, byte, 16).ptr == digits + 2 && byte >= kBeyondAscii) {
      bytes += static_cast<char>(byte);
      i += kEscape - 1;
    } else {
      bytes += text[i];
    }
  }
  return bytes;
}

bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// The digits that the text begins with go from it; zeros in front do not count.
std::string_view take_number(std::string_view& text) {
  const auto end = static_cast<std::size_t>(std::ranges::find_if_not(text, is_digit) - text.begin());
  std::string_view number = text.substr(0, end);
  text.remove_prefix(end);
  number.remove_prefix(std::min(number.find_first_not_of('0'), number.size()));
  return number;
}

/// Below, at or above 0, as strcmp; numbers of any length.
int compare_names(std::string_view a, std::string_view b) {
  while (!a.empty() && !b.empty()) {
    if (is_digit(a.front()) && is_digit(b.front())) {
      const std::string_view one = take_number(a), other = take_number(b);
      if (one.size() != other.size()) return one.size() < other.size() ? -1 : 1;
      if (const int order = one.compare(other); order != 0) return order;
    } else if (a.front() != b.front()) {
      return static_cast<unsigned char>(a.front()) < static_cast<unsigned char>(b.front()) ? -1 : 1;
    } else {
      a.remove_prefix(1);
      b.remove_prefix(1);
    }
  }
  return static_cast<int>(b.empty()) - static_cast<int>(a.empty());
}

const utf8proc_uint8_t* bytes_of(std::string_view text) {
  return reinterpret_cast<const utf8proc_uint8_t*>(text.data());
}

/// A text that is no UTF-8 stays as it is.
std::string mapped(std::string_view text, int options) {
  utf8proc_uint8_t* found = nullptr;
  const utf8proc_ssize_t n = utf8proc_map(bytes_of(text), static_cast<utf8proc_ssize_t>(text.size()), &found,
                                          static_cast<utf8proc_option_t>(options));
  if (n < 0) return std::string(text);
  const std::unique_ptr<utf8proc_uint8_t, decltype(&std::free)> owner(found, &std::free);
  return {found, found + n};
}

}  // namespace

std::string composed(std::string_view text) { return mapped(text, UTF8PROC_STABLE | UTF8PROC_COMPOSE); }

std::string folded(std::string_view text) {
  return mapped(text, UTF8PROC_STABLE | UTF8PROC_COMPOSE | UTF8PROC_CASEFOLD);
}

std::size_t utf8_length(std::string_view text) {
  utf8proc_int32_t character = 0;
  return static_cast<std::size_t>(std::max<utf8proc_ssize_t>(
      0, utf8proc_iterate(bytes_of(text), static_cast<utf8proc_ssize_t>(text.size()), &character)));
}

bool is_utf8(std::string_view text) {
  while (!text.empty()) {
    const std::size_t n = utf8_length(text);
    if (n == 0) return false;
    text.remove_prefix(n);
  }
  return true;
}

std::string byte_shown(char byte) {
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  const auto value = static_cast<unsigned char>(byte);
  return {'\\', 'x', kDigits[value / 16], kDigits[value % 16]};
}

std::string shown_name(std::string_view bytes) {
  if (is_utf8(bytes)) return std::string(bytes);
  std::string text;
  while (!bytes.empty()) {
    const std::size_t n = utf8_length(bytes);
    if (n == 0) {
      text += byte_shown(bytes.front());
      bytes.remove_prefix(1);
    } else {
      text += bytes.substr(0, n);
      bytes.remove_prefix(n);
    }
  }
  return text;
}

std::string lower_case(std::string text) {
  for (char& c : text)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  return text;
}

std::vector<std::string> parts_of(const std::string& list) {
  std::vector<std::string> parts;
  std::istringstream stream(list);
  for (std::string part; std::getline(stream, part, ',');) {
    const auto first = part.find_first_not_of(' '), last = part.find_last_not_of(' ');
    if (first != part.npos) parts.push_back(part.substr(first, last - first + 1));
  }
  return parts;
}

bool is_hidden(const std::filesystem::path& file) { return file.filename().native().starts_with('.'); }

bool is_before(const std::filesystem::path& a, const std::filesystem::path& b) {
  return std::lexicographical_compare(a.begin(), a.end(), b.begin(), b.end(), [](const auto& one, const auto& other) {
    const int order = compare_names(one.native(), other.native());
    return order == 0 ? one < other : order < 0;  // t1 and t01
  });
}

std::vector<std::filesystem::path> visible_in(const std::filesystem::path& folder, std::error_code& error) {
  std::vector<std::filesystem::path> found;
  for (std::filesystem::directory_iterator entry(folder, error), end; !error && entry != end; entry.increment(error))
    if (!is_hidden(entry->path())) found.push_back(entry->path());
  std::ranges::sort(found, is_before);
  return found;
}

std::vector<std::filesystem::path> visible_in(const std::filesystem::path& folder) {
  std::error_code ignored;
  return visible_in(folder, ignored);
}

std::filesystem::path file_shown_as(const std::filesystem::path& folder, const std::string& name) {
  std::error_code ignored;
  const std::filesystem::path same = folder / name;
  if (std::filesystem::exists(same, ignored)) return same;
  const std::string wanted = composed(same.filename().string());
  for (const std::filesystem::path& file : visible_in(same.parent_path()))
    if (composed(file.filename().string()) == wanted) return file;
  return folder / bytes_of_shown(name);
}

}  // namespace mbtfm::files
