/// Names of files and folders are bytes; tables, records and reports are UTF-8.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace mbtfm::files {

/// Length of the UTF-8 character that the text begins with; 0 where it begins with none.
std::size_t utf8_length(std::string_view text);
bool is_utf8(std::string_view text);
/// \\xE9
std::string byte_shown(char byte);

/// The text as UTF-8: a byte that belongs to no character is told as \\xE9, all else stays as it is.
std::string shown_name(std::string_view bytes);
/// The file in `folder` whose name is told so: one of just that name, else one of the same letters (ü as one character
/// or as two), else one with the bytes that it tells.
std::filesystem::path file_shown_as(const std::filesystem::path& folder, const std::string& name);

}  // namespace mbtfm::files
