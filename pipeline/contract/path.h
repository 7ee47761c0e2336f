/// Files and folders.
#pragma once

#include <filesystem>

namespace mbtfm {

using Path = std::filesystem::path;

}  // namespace mbtfm
