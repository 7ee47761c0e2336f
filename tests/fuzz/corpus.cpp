/// libFuzzer begins with the samples and the inputs that once broke the target: it is told where to put them by
/// MBTFM_FUZZ_CORPUS, a folder that it is then given as its corpus, too.
#include <cstdlib>
#include <fstream>

#include "tests/fuzz/target.h"

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  namespace fs = std::filesystem;
  const char* const corpus = std::getenv("MBTFM_FUZZ_CORPUS");
  if (!corpus) return 0;
  fs::create_directories(corpus);
  int n = 0;
  for (const std::string& sample : mbtfm::fuzz::samples())
    std::ofstream(fs::path(corpus) / ("sample-" + std::to_string(++n)), std::ios::binary) << sample;
  const fs::path kept = fs::path(MBTFM_SOURCE_DIR) / "tests/fuzz/regression" / mbtfm::fuzz::kFamily;
  if (fs::is_directory(kept)) fs::copy(kept, corpus, fs::copy_options::overwrite_existing);
  return 0;
}
