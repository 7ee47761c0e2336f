/// Files and folders.
#pragma once

#include <filesystem>

namespace mbtfm {

namespace fs = std::filesystem;
using Path = fs::path;

}  // namespace mbtfm
