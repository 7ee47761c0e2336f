#include "segment/images/tiff_handle.h"

#include <cstdarg>
#include <cstdio>

namespace mbtfm::images {
namespace {

int keep_error(TIFF*, void* messages, const char*, const char* format, va_list arguments) {
  char text[512];
  std::vsnprintf(text, sizeof text, format, arguments);
  auto& first = static_cast<Messages*>(messages)->first_error;
  if (first.empty()) first = text;
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
