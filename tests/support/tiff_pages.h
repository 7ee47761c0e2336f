/// TIFF files as other programs write them.
#pragma once

#include <tiffio.h>

#include "segment/images/image.h"
#include "tests/support/test.h"

namespace mbtfm::test {

/// One page an image, pixels of this type, the description on the first.
template <class Pixel>
void write_pages(const fs::path& file, const std::vector<images::Image>& pages, const std::string& description) {
  TIFF* tiff = TIFFOpen(file.c_str(), "w");
  for (const images::Image& page : pages) {
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, page.width);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, page.height);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 8 * static_cast<int>(sizeof(Pixel)));
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, std::is_floating_point_v<Pixel> ? SAMPLEFORMAT_IEEEFP : SAMPLEFORMAT_UINT);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    if (&page == &pages.front()) TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, description.c_str());
    std::vector<Pixel> row(static_cast<std::size_t>(page.width));
    for (int j = 0; j < page.height; ++j) {
      for (int i = 0; i < page.width; ++i)
        row[i] = static_cast<Pixel>(std::is_floating_point_v<Pixel> ? page.at(i, j) : std::round(page.at(i, j)));
      TIFFWriteScanline(tiff, row.data(), static_cast<std::uint32_t>(j), 0);
    }
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
}

}  // namespace mbtfm::test
