/// Files as whole texts.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace mbtfm::files {

/// The whole of a file. @throws InputError
std::string read_text(const std::filesystem::path& file);
/// Write all or throw; a link of that name is replaced, not followed. @throws OutputError
void write_text(const std::filesystem::path& file, std::string_view text);

/// How the name of a file begins that is not whole yet.
inline constexpr std::string_view kPartialPrefix = ".partial-";
/// The name under which a file is written until it is whole: beside its own, with the same extension.
std::filesystem::path temporary_name(const std::filesystem::path& file);
/// Write to the temporary name and rename; a link of that name is replaced, not followed. @throws OutputError
void write_whole(const std::filesystem::path& file, std::string_view text);

}  // namespace mbtfm::files
