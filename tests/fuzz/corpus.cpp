/// Under libFuzzer one target, MBTFM_FUZZ_FAMILY, reads. It begins with the samples and the inputs that once broke it:
/// it puts them into MBTFM_FUZZ_CORPUS, a folder that libFuzzer is then given as its corpus, too.
#include "tests/fuzz/target.h"
#include "tests/support/folders.h"
#include "tests/support/test.h"

namespace {

const mbtfm::fuzz::Target& chosen() {
  static const mbtfm::fuzz::Target target = [] {
    const char* const family = std::getenv("MBTFM_FUZZ_FAMILY");
    const auto& all = mbtfm::fuzz::targets();
    const auto found = std::find_if(all.begin(), all.end(),
                                    [&](const auto& each) { return family && each.family == std::string(family); });
    if (found == all.end()) std::abort();
    return *found;
  }();
  return target;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t n) {
  chosen().read({reinterpret_cast<const char*>(bytes), n});
  return 0;
}

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  namespace fs = std::filesystem;
  const char* const corpus = std::getenv("MBTFM_FUZZ_CORPUS");
  if (!corpus) return 0;
  fs::create_directories(corpus);
  int n = 0;
  for (const std::string& sample : chosen().samples())
    std::ofstream(fs::path(corpus) / ("sample-" + std::to_string(++n)), std::ios::binary) << sample;
  const fs::path kept = mbtfm::test::source_folder() / "tests/fuzz/regression" / chosen().family;
  if (fs::is_directory(kept)) fs::copy(kept, corpus, fs::copy_options::overwrite_existing);
  return 0;
}
