#include <cstdio>  // jpeglib.h needs it before

#include <jpeglib.h>

#include "segment/images/image.h"
#include "segment/images/png.h"
#include "tests/fuzz/target.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::images {
namespace {

using fuzz::bytes_of;
using fuzz::put;

/// The image, or an InputError; anything else fails the test.
bool is_read(const fs::path& file) {
  return !test::caught<InputError>([&] { read_image(file); });
}

Image sample() {
  std::mt19937 random(7);
  Image image{.width = 61, .height = 150, .pixel_size_um = 0.1, .full_scale = 0};
  for (int k = 0; k < image.width * image.height; ++k) image.pixels.push_back(static_cast<float>(random() % 4096));
  return image;
}

Picture speckled() {
  std::mt19937 random(3);
  Picture picture{.width = 40, .height = 30};
  for (int k = 0; k < 3600; ++k) picture.rgb.push_back(static_cast<std::uint8_t>(random() % 256));
  return picture;
}

/// A progressive JPEG of 127 passes, each within the rules: every wave in two passes of its own.
void write_many_passes(const fs::path& file) {
  std::vector<jpeg_scan_info> passes = {{1, {0}, 0, 0, 0, 0}};
  for (int wave = 1; wave < 64; ++wave) {
    passes.push_back({1, {0}, wave, wave, 0, 1});
    passes.push_back({1, {0}, wave, wave, 1, 0});
  }
  jpeg_compress_struct jpeg{};
  jpeg_error_mgr errors{};
  jpeg.err = jpeg_std_error(&errors);
  jpeg_create_compress(&jpeg);
  std::FILE* stream = std::fopen(file.c_str(), "wb");
  jpeg_stdio_dest(&jpeg, stream);
  jpeg.image_width = jpeg.image_height = 16;
  jpeg.input_components = 1;
  jpeg.in_color_space = JCS_GRAYSCALE;
  jpeg_set_defaults(&jpeg);
  jpeg.scan_info = passes.data();
  jpeg.num_scans = static_cast<int>(passes.size());
  jpeg_start_compress(&jpeg, TRUE);
  std::vector<JSAMPLE> row(16, 99);
  JSAMPLE* rows = row.data();
  while (jpeg.next_scanline < 16) jpeg_write_scanlines(&jpeg, &rows, 1);
  jpeg_finish_compress(&jpeg);
  jpeg_destroy_compress(&jpeg);
  std::fclose(stream);
}

TEST(ImageFuzz, a_jpeg_of_endless_passes_is_an_input_error) {
  const test::TemporaryFolder folder;
  write_many_passes(folder / "passes.jpg");
  const InputError error = test::thrown<InputError>([&] { read_image(folder / "passes.jpg"); });
  EXPECT_TRUE(has_words(error.found, "passes")) << error.what();
}

TEST(ImageFuzz, a_truncated_file_is_an_input_error_at_every_length) {
  const test::TemporaryFolder folder;
  write_tiff(folder / "a.tif", sample());
  write_png(folder / "a.png", {.width = 40, .height = 30, .rgb = std::vector<std::uint8_t>(3600, 17)});
  write_jpeg(folder / "a.jpg", speckled());
  for (const char* name : {"a.tif", "a.png", "a.jpg"}) {
    const std::string whole = bytes_of(folder / name);
    for (std::size_t length = 0; length < whole.size(); length += 1 + whole.size() / 150) {
      EXPECT_FALSE(is_read(put("cut", whole.substr(0, length))))
          << name << " cut to " << length << " of " << whole.size() << " bytes";
    }
  }
}

}  // namespace
}  // namespace mbtfm::images
