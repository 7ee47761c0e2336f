/// The text of a table as other programs save it.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace mbtfm::files {

/// As UTF-8 with a line feed after each line, from UTF-8, UTF-16 or Latin-1. Written to `place` if it is not so
/// already.
std::string_view as_text(std::string_view bytes, std::string& place);

/// A cell in quotes may have line breaks in it: `line` grows to the end of the line that closes the quotes, `rest`
/// begins after it. @param line  which `rest` follows in the text @returns the lines added; 0: no quote is open, or
/// none is closed
int take_quoted_breaks(std::string_view& rest, std::string_view& line);

/// The bytes of a file. @throws InputError where it is a workbook, compressed, or MATLAB's
std::string read_table_text(const std::filesystem::path& file);

}  // namespace mbtfm::files
