#include "segment/images/tiff_handle.h"

#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <set>

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

}  // namespace mbtfm::images
