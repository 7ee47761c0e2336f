/// Images as microscopes and ImageJ write them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <vector>

namespace mbtfm::segment {

/// A grey image, row by row from the top.
struct Image {
  int width = 0;
  int height = 0;
  std::vector<float> pixels;
  std::optional<double> pixel_size_um;  ///< from the file's own calibration
  double full_scale = 0;                ///< the value at which the detector saturates; 0: none (float)
  float at(int column, int row) const { return pixels[static_cast<std::size_t>(row) * width + column]; }
  float& at(int column, int row) { return pixels[static_cast<std::size_t>(row) * width + column]; }
};

/// Read one page (0: the first) of a TIFF (8 or 16 bit, float; any libtiff compression) or a PNG.
/// Calibration: OME PhysicalSizeX, ImageJ unit + resolution, Volocity.
/// @throws InputError naming the file and what it is instead; reads no more memory than the file can fill
Image read_image(const std::filesystem::path& file, int page = 0);

/// 16-bit TIFF, deflate, with ImageJ's calibration. Values are rounded and clamped to 0 … 65535.
/// @throws OutputError
void write_tiff(const std::filesystem::path& file, const Image& image);

}  // namespace mbtfm::segment
