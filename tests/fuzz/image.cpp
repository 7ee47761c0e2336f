#include "segment/image.h"

#include <gtest/gtest.h>

#include <fstream>
#include <random>

#include "pipeline/contract/errors.h"
#include "segment/png.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::segment {
namespace {

namespace fs = std::filesystem;

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {(std::istreambuf_iterator<char>(in)), {}};
}

/// The image, or an InputError; anything else fails the test.
bool is_read(const fs::path& file) {
  try {
    read_image(file);
    return true;
  } catch (const InputError&) {
    return false;
  }
}

Image sample() {
  std::mt19937 random(7);
  Image image{.width = 61, .height = 150, .pixels = {}, .pixel_size_um = 0.1, .full_scale = 0};
  for (int k = 0; k < image.width * image.height; ++k) image.pixels.push_back(static_cast<float>(random() % 4096));
  return image;
}

TEST(ImageFuzz, a_truncated_file_is_an_input_error_at_every_length) {
  const test::TemporaryFolder folder;
  write_tiff(folder / "a.tif", sample());
  write_png(folder / "a.png", {.width = 40, .height = 30, .rgb = std::vector<std::uint8_t>(3600, 17)});
  for (const char* name : {"a.tif", "a.png"}) {
    const std::string whole = bytes_of(folder / name);
    for (std::size_t length = 0; length < whole.size(); length += 1 + whole.size() / 150) {
      std::ofstream(folder / "cut", std::ios::binary) << whole.substr(0, length);
      EXPECT_FALSE(is_read(folder / "cut")) << name << " cut to " << length << " of " << whole.size() << " bytes";
    }
  }
}

TEST(ImageFuzz, changed_bytes_never_crash_the_reader) {
  const test::TemporaryFolder folder;
  write_tiff(folder / "a.tif", sample());
  write_png(folder / "a.png", {.width = 40, .height = 30, .rgb = std::vector<std::uint8_t>(3600, 17)});
  std::mt19937 random(1);
  for (const char* name : {"a.tif", "a.png"}) {
    const std::string whole = bytes_of(folder / name);
    // a TIFF of ours has its tags at the end, a PNG its header at the start
    const std::size_t from = name == std::string("a.tif") ? whole.size() - 260 : 0;
    for (int round = 0; round < 400; ++round) {
      std::string changed = whole;
      const std::size_t n_changes = 1 + random() % 4;
      for (std::size_t k = 0; k < n_changes; ++k) {
        const std::size_t at = from + random() % std::min<std::size_t>(260, whole.size() - from);
        changed[at] = static_cast<char>(random());
      }
      std::ofstream(folder / "changed", std::ios::binary) << changed;
      is_read(folder / "changed");
    }
  }
}

TEST(ImageFuzz, the_files_of_other_programs_decode_or_are_refused) {
  const fs::path shared = fs::path(MBTFM_SOURCE_DIR).parent_path() / "shared/data/tiff";
  if (!fs::exists(shared)) GTEST_SKIP() << "the images of other programs are not here";
  const test::TemporaryFolder folder;
  std::mt19937 random(3);
  for (const auto& entry : fs::recursive_directory_iterator(shared)) {
    if (!entry.is_regular_file() || entry.path().extension() == ".csv") continue;
    is_read(entry.path());
    const std::string whole = bytes_of(entry.path());
    for (int round = 0; round < 6; ++round) {
      std::string changed = whole.substr(0, whole.size() - (round % 2) * (random() % whole.size()));
      if (changed.size() > 8)
        changed[4 + random() % std::min<std::size_t>(400, changed.size() - 4)] ^= 1 << random() % 8;
      std::ofstream(folder / "changed", std::ios::binary) << changed;
      is_read(folder / "changed");
    }
  }
}

}  // namespace
}  // namespace mbtfm::segment
