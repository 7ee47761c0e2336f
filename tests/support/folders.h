/// Where the sources and the build lie.
#pragma once

#include <filesystem>

namespace mbtfm::test {

std::filesystem::path source_folder();
std::filesystem::path build_folder();

}  // namespace mbtfm::test
