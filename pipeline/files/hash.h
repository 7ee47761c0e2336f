/// Content hashes, for provenance and to know what is up to date.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>

namespace mbtfm::files {

/// SHA-256 in hexadecimal.
std::string sha256(std::string_view bytes);
/// SHA-256 of a file's bytes. @throws InputError where it cannot be read
std::string sha256_of_file(const std::filesystem::path& file);

}  // namespace mbtfm::files
