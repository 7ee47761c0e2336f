/// libtiff's files, closed in time, and its complaints of each. Internal to the image reader (libtiff types).
#pragma once

#include <tiffio.h>

#include <filesystem>
#include <memory>
#include <string>

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

}  // namespace mbtfm::images
