/// libtiff's files, closed in time, its complaints of each, and how their samples lie. Internal to the image reader
/// (libtiff types).
#pragma once

#include <tiffio.h>

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace mbtfm::images {

/// libtiff's complaints of one file; the first is the cause.
struct Messages {
  std::string first_error;
};

struct TiffCloser {
  void operator()(TIFF* tiff) const { TIFFClose(tiff); }
};
using TiffHandle = std::unique_ptr<TIFF, TiffCloser>;

/// Nothing is printed; null where it cannot be opened. `messages` must outlive the handle.
TiffHandle open_tiff(const std::filesystem::path& file, const char* mode, Messages& messages);

template <class T>
T tag_of(TIFF* tiff, ttag_t name, T otherwise) {
  T value{};
  return TIFFGetFieldDefaulted(tiff, name, &value) ? value : otherwise;
}

/// How the samples of a page are laid out.
struct Layout {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint16_t bits = 1;
  std::uint16_t format = SAMPLEFORMAT_UINT;
  std::uint16_t samples = 1;     ///< by pixel, alpha included
  std::uint16_t n_channels = 1;  ///< of them: alpha is none, red, green and blue are three
  std::uint16_t first = 0;       ///< of those whose mean is the grey value
  std::uint16_t colours = 1;     ///< how many: 1, or 3 for RGB
  bool is_rgb = false;
  bool is_planar = false;
  bool is_inverted = false;  ///< 0 is white
};

/// Of the page that is open. @throws InputError where no grey values follow from it
Layout layout_of(TIFF* tiff, const std::filesystem::path& file);

/// Samples to floats. libtiff has put 16-, 24-, 32- and 64-bit samples into this machine's byte order; other widths
/// are packed from the highest bit on, without gaps.
void unpack(const unsigned char* bytes, const Layout& layout, std::vector<float>& row);

}  // namespace mbtfm::images
