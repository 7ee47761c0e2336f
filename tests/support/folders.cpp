#include "tests/support/folders.h"

namespace mbtfm::test {

std::filesystem::path source_folder() { return MBTFM_SOURCE_DIR; }
std::filesystem::path build_folder() { return MBTFM_BINARY_DIR; }

}  // namespace mbtfm::test
