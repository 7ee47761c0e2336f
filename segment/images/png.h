/// Pictures for the eye.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace mbtfm::images {

/// A colour picture, row by row from the top, red, green, blue.
struct Picture {
  int width = 0;
  int height = 0;
  std::vector<std::uint8_t> rgb;
};

/// The bytes of a PNG file.
std::string png_of(const Picture& picture);
/// @throws OutputError
void write_png(const std::filesystem::path& file, const Picture& picture);
/// A tenth of the size, with some loss. @throws OutputError
void write_jpeg(const std::filesystem::path& file, const Picture& picture);

}  // namespace mbtfm::images
