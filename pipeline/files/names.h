/// Names of files and folders are bytes; tables, records and reports are UTF-8.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>
#include <vector>

namespace mbtfm::files {

/// Length of the UTF-8 character that the text begins with; 0 where it begins with none.
std::size_t utf8_length(std::string_view text);
bool is_utf8(std::string_view text);
/// \\xE9
std::string byte_shown(char byte);

/// The text as UTF-8: a byte that belongs to no character is shown as \\xE9, all else stays as it is.
std::string shown_name(std::string_view bytes);
/// The file in `folder` whose name is shown so: one of just that name, else one of the same letters (ü as one character
/// or as two), else one with the bytes that it shows.
std::filesystem::path file_shown_as(const std::filesystem::path& folder, const std::string& name);

/// A letter and a mark behind it as one character, as keyboards write them: ü, where a Mac's file names have u and ¨.
std::string composed(std::string_view text);

/// For comparing what people write: composed, and small letters for capitals, of any script.
std::string folded(std::string_view text);

/// Letters of ASCII as small ones.
std::string lower_case(std::string text);

/// The parts between commas, without spaces around them and none of them empty.
std::vector<std::string> parts_of(const std::string& list);

/// Whether the name begins with a point: it is no cell, no frame, no picture and no table, wherever it lies.
bool is_hidden(const std::filesystem::path& file);

/// Numbers in names count as numbers, as in file managers: t2 is before t10, and day 2/a before day 10/a.
bool is_before(const std::filesystem::path& a, const std::filesystem::path& b);

/// What is in a folder, as is_before orders it, without what is hidden; what can be read of it, and the error.
std::vector<std::filesystem::path> visible_in(const std::filesystem::path& folder, std::error_code& error);
/// The same where a folder that cannot be read has nothing.
std::vector<std::filesystem::path> visible_in(const std::filesystem::path& folder);

}  // namespace mbtfm::files
