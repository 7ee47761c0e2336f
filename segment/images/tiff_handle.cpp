#include "segment/images/tiff_handle.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <set>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "segment/images/image.h"

namespace mbtfm::images {
namespace {

/// libtiff complains of each tag that is not as it expects; those of other programs (private ones), and names and
/// dates, are not needed for the pixels.
bool is_of_a_needed_tag(const std::string& message) {
  static const std::set<std::string> needed = {"ImageWidth",
                                               "ImageLength",
                                               "BitsPerSample",
                                               "Compression",
                                               "PhotometricInterpretation",
                                               "ImageDescription",
                                               "StripOffsets",
                                               "SamplesPerPixel",
                                               "RowsPerStrip",
                                               "StripByteCounts",
                                               "XResolution",
                                               "YResolution",
                                               "PlanarConfiguration",
                                               "ResolutionUnit",
                                               "Predictor",
                                               "ColorMap",
                                               "TileWidth",
                                               "TileLength",
                                               "TileOffsets",
                                               "TileByteCounts",
                                               "ExtraSamples",
                                               "SampleFormat",
                                               "JPEGTables",
                                               "FillOrder",
                                               "YCbCrSubsampling",
                                               "ReferenceBlackWhite",
                                               "SubFileType"};
  const std::size_t begin = message.find('"'), end = message.find('"', begin + 1);
  return begin == std::string::npos || end == std::string::npos ||
         needed.contains(message.substr(begin + 1, end - begin - 1));
}

int keep_error(TIFF*, void* messages, const char*, const char* format, va_list arguments) {
  char text[512];
  std::vsnprintf(text, sizeof text, format, arguments);
  auto& first = static_cast<Messages*>(messages)->first_error;
  if (first.empty() && is_of_a_needed_tag(text)) first = text;
  return 1;  // handled: nothing goes to the terminal
}

/// Warnings are of no concern, but for the one that a file ends within its tags: the calibration may be lost with them.
int keep_warning_of_early_end(TIFF* tiff, void* messages, const char* module, const char* format, va_list arguments) {
  char text[512];
  va_list copy;
  va_copy(copy, arguments);
  std::vsnprintf(text, sizeof text, format, copy);
  va_end(copy);
  if (std::strstr(text, "IO error during reading")) return keep_error(tiff, messages, module, format, arguments);
  return 1;
}

}  // namespace

TiffHandle open_tiff(const std::filesystem::path& file, const char* mode, Messages& messages) {
  const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> options(TIFFOpenOptionsAlloc(),
                                                                                 &TIFFOpenOptionsFree);
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), keep_error, &messages);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), keep_warning_of_early_end, &messages);
  return TiffHandle(TIFFOpenExt(file.c_str(), mode, options.get()));
}

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
