/// A C library's open file, closed in time.
#pragma once

#include <cstdio>
#include <memory>

namespace mbtfm::images {

struct FileCloser {
  void operator()(std::FILE* stream) const { std::fclose(stream); }
};
using FileHandle = std::unique_ptr<std::FILE, FileCloser>;

}  // namespace mbtfm::images
