#include "pipeline/files/table_text.h"

#include <algorithm>
#include <cstdint>

#include "pipeline/contract/errors.h"
#include "pipeline/files/names.h"
#include "pipeline/files/text.h"

namespace mbtfm::files {
namespace {

constexpr std::string_view kByteOrder = "\xEF\xBB\xBF";

void append_utf8(std::string& text, std::uint32_t c) {
  constexpr std::uint32_t kFirst[] = {0, 0xC0, 0xE0, 0xF0};
  const int n_more = c < 0x80 ? 0 : c < 0x800 ? 1 : c < 0x10000 ? 2 : 3;
  text += static_cast<char>(kFirst[n_more] | c >> 6 * n_more);
  for (int k = n_more; k-- > 0;) text += static_cast<char>(0x80 | (c >> 6 * k & 0x3F));
}

std::string from_utf16(std::string_view bytes, bool is_big_endian) {
  const auto unit = [&](std::size_t i) -> std::uint32_t {
    const auto first = static_cast<unsigned char>(bytes[i]), second = static_cast<unsigned char>(bytes[i + 1]);
    return is_big_endian ? first << 8 | second : second << 8 | first;
  };
  std::string text;
  for (std::size_t i = 0; i + 1 < bytes.size(); i += 2) {
    std::uint32_t c = unit(i);
    if (c >= 0xD800 && c < 0xDC00 && i + 3 < bytes.size() && unit(i + 2) >= 0xDC00 && unit(i + 2) < 0xE000) {
      c = 0x10000 + ((c - 0xD800) << 10) + (unit(i + 2) - 0xDC00);
      i += 2;
    }
    append_utf8(text, c >= 0xD800 && c < 0xE000 ? 0xFFFD : c);
  }
  return text;
}

/// What is neither UTF-8 nor UTF-16 is Latin-1, as of older programs: "\xB5m".
std::string from_latin1(std::string_view bytes) {
  std::string text;
  for (const char c : bytes) append_utf8(text, static_cast<unsigned char>(c));
  return text;
}

bool is_ascii(std::string_view text) {
  return std::ranges::none_of(text, [](char c) { return static_cast<unsigned char>(c) >= 0x80; });
}

}  // namespace

std::string_view as_text(std::string_view bytes, std::string& place) {
  // half of the bytes of UTF-16 are zero where it holds numbers, whether it says so by a byte order mark or not
  const bool is_little = bytes.starts_with("\xFF\xFE") || (bytes.size() > 1 && bytes[0] != 0 && bytes[1] == 0);
  const bool is_big = bytes.starts_with("\xFE\xFF") || (bytes.size() > 1 && bytes[0] == 0 && bytes[1] != 0);
  if (is_little || is_big) bytes = place = from_utf16(bytes, is_big);
  if (bytes.starts_with(kByteOrder)) bytes.remove_prefix(kByteOrder.size());
  if (!is_ascii(bytes) && !is_utf8(bytes)) bytes = place = from_latin1(bytes);
  if (bytes.find('\n') == bytes.npos && bytes.find('\r') != bytes.npos) {
    bytes = place = std::string(bytes);
    std::ranges::replace(place, '\r', '\n');
  }
  return bytes;
}

int take_quoted_breaks(std::string_view& rest, std::string_view& line) {
  const auto is_open = [](std::string_view text) { return std::ranges::count(text, '"') % 2 != 0; };
  if (!is_open(line)) return 0;
  const std::string_view whole(line.data(), static_cast<std::size_t>(rest.data() - line.data()) + rest.size());
  for (std::size_t end = line.size(); end < whole.size();) {
    end = std::min(whole.find('\n', end + 1), whole.size());
    if (is_open(whole.substr(0, end))) continue;
    line = whole.substr(0, end);
    rest = whole.substr(std::min(end + 1, whole.size()));
    return static_cast<int>(std::ranges::count(line, '\n'));
  }
  return 0;
}

std::string read_table_text(const std::filesystem::path& file) {
  std::string bytes = read_text(file);
  const auto refuse = [&](const char* found, const std::string& remedy) {
    throw InputError(file.string(), "a table as text", found, remedy);
  };
  if (bytes.starts_with("PK\x03\x04") || bytes.starts_with("\xD0\xCF\x11\xE0"))  // .xlsx and .ods; .xls
    refuse("a workbook of a spreadsheet program", "save its sheet as CSV in that program");
  if (bytes.starts_with("\x1F\x8B")) refuse("a compressed file", "unpack it: gunzip '" + file.string() + "'");
  if (bytes.starts_with("MATLAB ") || bytes.starts_with("\x89HDF"))
    refuse("a file of MATLAB", "in MATLAB: writetable(table(x(:), y(:), u(:), v(:)), 'field.csv')");
  if (bytes.starts_with("<?xml"))
    refuse("an XML file", "export a table as CSV; in TrackMate: Spots, then Export to CSV");
  return bytes;
}

}  // namespace mbtfm::files
