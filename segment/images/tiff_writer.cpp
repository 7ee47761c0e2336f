#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "segment/images/image.h"
#include "segment/images/tiff_handle.h"

namespace mbtfm::images {
namespace {

/// What ImageJ says of an image, or of the slices of a stack.
std::string description_of(const Image& image, std::size_t n_slices) {
  std::string text = "ImageJ=1.53t\n";
  const std::string n = std::to_string(n_slices);
  if (n_slices > 1) text += "images=" + n + "\nslices=" + n + "\n";
  if (image.pixel_size_um) text += "unit=micron\n";
  if (n_slices > 1 && image.z_step_um) text += "spacing=" + shortest(*image.z_step_um) + "\n";
  return text;
}

void set_tags(TIFF* tiff, const Image& image, const std::string& description) {
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(image.width));
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(image.height));
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
  TIFFSetField(tiff, TIFFTAG_PREDICTOR, PREDICTOR_HORIZONTAL);
  TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, static_cast<std::uint32_t>(std::min(image.height, 64)));
  TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, description.c_str());
  if (!image.pixel_size_um) return;
  TIFFSetField(tiff, TIFFTAG_XRESOLUTION, 1 / *image.pixel_size_um);
  TIFFSetField(tiff, TIFFTAG_YRESOLUTION, 1 / *image.pixel_size_um);
  TIFFSetField(tiff, TIFFTAG_RESOLUTIONUNIT, RESUNIT_NONE);
}

}  // namespace

void write_tiff(const std::filesystem::path& file, const Image& image) { write_tiff(file, std::vector{image}); }

void write_tiff(const std::filesystem::path& file, const std::vector<Image>& slices) {
  MBTFM_ASSERT(!slices.empty() && slices.front().width > 0 && slices.front().height > 0);
  Messages messages;
  const auto require = [&](bool is_done) {
    if (!is_done)
      throw OutputError(file.string() + ": cannot be written" +
                        (messages.first_error.empty() ? "" : ": " + messages.first_error));
  };
  TiffHandle tiff = open_tiff(file, "w", messages);
  require(tiff != nullptr);
  const std::string description = description_of(slices.front(), slices.size());
  for (const Image& image : slices) {
    set_tags(tiff.get(), image, description);
    std::vector<std::uint16_t> row(static_cast<std::size_t>(image.width));
    for (int j = 0; j < image.height; ++j) {
      for (int i = 0; i < image.width; ++i)
        row[i] = static_cast<std::uint16_t>(std::clamp(std::round(image.at(i, j)), 0.0f, 65535.0f));
      require(TIFFWriteScanline(tiff.get(), row.data(), static_cast<std::uint32_t>(j), 0) == 1);
    }
    require(TIFFWriteDirectory(tiff.get()) == 1);
  }
  tiff.reset();
  require(messages.first_error.empty());
}

}  // namespace mbtfm::images
