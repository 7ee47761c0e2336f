#include <tiffio.h>

#include <cstdio>  // jpeglib.h needs it before

#include <jpeglib.h>

#include "pipeline/contract/errors.h"
#include "segment/images/image.h"
#include "segment/images/png.h"
#include "tests/support/folders.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/test.h"

namespace mbtfm::images {
namespace {

std::string bytes_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {(std::istreambuf_iterator<char>(in)), {}};
}

/// As a new file: to overwrite an old one, some file systems wait for the disk.
void write(const fs::path& file, const std::string& bytes) {
  fs::remove(file);
  std::ofstream(file, std::ios::binary) << bytes;
}

/// The image, or an InputError; anything else fails the test.
bool is_read(const fs::path& file, const PlaneChoice& choice = {}) {
  try {
    read_image(file, choice);
    return true;
  } catch (const InputError&) {
    return false;
  }
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
  try {
    read_image(folder / "passes.jpg");
    FAIL() << "was read";
  } catch (const InputError& error) {
    EXPECT_NE(error.found.find("passes"), std::string::npos) << error.what();
  }
}

TEST(ImageFuzz, a_truncated_file_is_an_input_error_at_every_length) {
  const test::TemporaryFolder folder;
  write_tiff(folder / "a.tif", sample());
  write_png(folder / "a.png", {.width = 40, .height = 30, .rgb = std::vector<std::uint8_t>(3600, 17)});
  write_jpeg(folder / "a.jpg", speckled());
  for (const char* name : {"a.tif", "a.png", "a.jpg"}) {
    const std::string whole = bytes_of(folder / name);
    for (std::size_t length = 0; length < whole.size(); length += 1 + whole.size() / 150) {
      write(folder / "cut", whole.substr(0, length));
      EXPECT_FALSE(is_read(folder / "cut")) << name << " cut to " << length << " of " << whole.size() << " bytes";
    }
  }
}

TEST(ImageFuzz, changed_bytes_never_crash_the_reader) {
  const test::TemporaryFolder folder;
  write_tiff(folder / "a.tif", sample());
  write_png(folder / "a.png", {.width = 40, .height = 30, .rgb = std::vector<std::uint8_t>(3600, 17)});
  write_jpeg(folder / "a.jpg", speckled());
  std::mt19937 random(1);
  for (const char* name : {"a.tif", "a.png", "a.jpg"}) {
    const std::string whole = bytes_of(folder / name);
    // a TIFF of ours has its tags at the end, the others their headers at the start
    const std::size_t from = name == std::string("a.tif") ? whole.size() - 260 : 0;
    for (int round = 0; round < 400; ++round) {
      std::string changed = whole;
      const std::size_t n_changes = 1 + random() % 4;
      for (std::size_t k = 0; k < n_changes; ++k) {
        const std::size_t at = from + random() % std::min<std::size_t>(260, whole.size() - from);
        changed[at] = static_cast<char>(random());
      }
      write(folder / "changed", changed);
      is_read(folder / "changed");
    }
  }
}

/// Pages of 8 x 8 pixels, the first with a description.
std::string stack(const fs::path& file, const std::string& description) {
  TIFF* tiff = TIFFOpen(file.c_str(), "w");
  for (int page = 0; page < 6; ++page) {
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 8);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 8);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 8);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    if (page == 0) TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, description.c_str());
    std::string row(8, static_cast<char>(page));
    for (std::uint32_t j = 0; j < 8; ++j) TIFFWriteScanline(tiff, row.data(), j, 0);
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
  return bytes_of(file);
}

TEST(ImageFuzz, damaged_descriptions_of_stacks_never_crash_the_reader) {
  const test::TemporaryFolder folder;
  std::mt19937 random(11);
  for (const std::string& description :
       {std::string("ImageJ=1.53t\nimages=6\nchannels=2\nslices=3\nunit=micron\n"),
        std::string("<OME UUID='urn:uuid:a'><Image><Pixels DimensionOrder='XYZCT' SizeC='2' SizeZ='3' SizeT='1' "
                    "PhysicalSizeX='0.1'><Channel Name='a'/><Channel Name='b'/><TiffData IFD='0' FirstC='1' "
                    "PlaneCount='3'><UUID FileName='a.tif'>urn:uuid:a</UUID></TiffData></Pixels></Image></OME>")}) {
    fs::remove(folder / "whole");
    const std::string whole = stack(folder / "whole", description);
    const std::size_t from = whole.find(description);
    ASSERT_NE(from, std::string::npos);
    for (int round = 0; round < 1500; ++round) {
      std::string changed = whole;
      for (std::size_t k = 0; k < 1 + random() % 3; ++k) {
        const std::size_t at = from + random() % description.size();
        changed[at] = random() % 2 ? static_cast<char>('0' + random() % 10) : static_cast<char>(random());
      }
      write(folder / "changed", changed);
      is_read(folder / "changed", {.channel = "1"});
    }
  }
}

TEST(ImageFuzz, the_files_of_other_programs_decode_or_are_refused) {
  const fs::path shared = test::source_folder().parent_path() / "shared/data/tiff";
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
      write(folder / "changed", changed);
      is_read(folder / "changed");
    }
  }
}

}  // namespace
}  // namespace mbtfm::images
