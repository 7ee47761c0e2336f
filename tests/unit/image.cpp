#include <png.h>
#include <sys/stat.h>
#include <tiffio.h>

#include "pipeline/contract/errors.h"
#include "pipeline/files/text.h"
#include "segment/images/channels.h"
#include "segment/images/image.h"
#include "segment/images/image_file.h"
#include "segment/images/png.h"
#include "tests/support/findings.h"
#include "tests/support/folders.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::images {
namespace {

using test::fires;

Image ramp(int width, int height) {
  Image image;
  image.width = width;
  image.height = height;
  for (int k = 0; k < width * height; ++k) image.pixels.push_back(static_cast<float>(37 * k % 60000));
  return image;
}

TEST(Image, a_written_tiff_comes_back_with_its_calibration) {
  const TemporaryFolder folder;
  Image image = ramp(123, 77);
  for (const double pixel_size_um : {0.1, 0.1625, 0.125, 0.06475, 0.64}) {
    image.pixel_size_um = pixel_size_um;
    write_tiff(folder / "a.tif", image);
    const Image back = read_image(folder / "a.tif");
    EXPECT_EQ(back.width, 123);
    EXPECT_EQ(back.height, 77);
    EXPECT_EQ(back.pixels, image.pixels);
    EXPECT_EQ(back.full_scale, 65535);
    ASSERT_TRUE(back.pixel_size_um);
    EXPECT_DOUBLE_EQ(*back.pixel_size_um, pixel_size_um);  // six digits come back as they were
  }
  image.pixel_size_um.reset();
  write_tiff(folder / "b.tif", image);
  EXPECT_FALSE(read_image(folder / "b.tif").pixel_size_um);
}

TEST(Image, a_pipe_is_refused_and_not_waited_for) {
  const TemporaryFolder folder;
  ASSERT_EQ(mkfifo((folder / "a.tif").c_str(), 0600), 0);
  EXPECT_THROW(read_image(folder / "a.tif"), InputError);
  EXPECT_THROW(read_image("/dev/null"), InputError);
}

TEST(Image, binned_ones_hold_the_means_of_whole_blocks_and_keep_their_scale) {
  Image image = ramp(7, 5);
  image.pixel_size_um = 0.1;
  const Image half = binned(image, 2);
  EXPECT_EQ(half.width, 3);
  EXPECT_EQ(half.height, 2);
  EXPECT_DOUBLE_EQ(*half.pixel_size_um, 0.2);
  EXPECT_FLOAT_EQ(half.at(2, 1), (image.at(4, 2) + image.at(5, 2) + image.at(4, 3) + image.at(5, 3)) / 4);
  EXPECT_EQ(binned(image, 1).pixels, image.pixels);
  EXPECT_THROW(binned(image, 6), InvalidData);
}

TEST(Image, values_outside_16_bits_are_clamped_and_fractions_rounded) {
  const TemporaryFolder folder;
  Image image{.width = 4, .height = 1, .pixels = {-3.0f, 1.5f, 70000.0f, 2.4f}, .full_scale = 0};
  write_tiff(folder / "a.tif", image);
  EXPECT_EQ(read_image(folder / "a.tif").pixels, (std::vector<float>{0, 2, 65535, 2}));
}

TEST(Image, colour_is_read_as_the_mean_of_red_green_and_blue) {
  const TemporaryFolder folder;
  write_png(folder / "a.png", {.width = 2, .height = 1, .rgb = {10, 20, 60, 7, 7, 7}});
  const Image image = read_image(folder / "a.png");
  EXPECT_EQ(image.pixels, (std::vector<float>{30, 7}));
  EXPECT_EQ(image.full_scale, 255);
  EXPECT_EQ(read_image(folder / "a.png", {.channel = "green"}).pixels, (std::vector<float>{20, 7}));
  EXPECT_THROW(read_image(folder / "a.png", {.channel = "cyan"}), InputError);
  EXPECT_THROW(read_image(folder / "a.png", {.page = 2}), InputError);
  EXPECT_THROW(read_image(folder / "a.png", {.time = 2}), InputError);
}

struct CalibrationCase {
  const char* description;
  std::optional<double> x_resolution, y_resolution, expected_um;
};

TEST(Image, calibration_is_understood_in_each_dialect) {
  const CalibrationCase cases[] = {
      {"ImageJ=1.53t\nunit=micron\n", 6.153846, 6.153846, 0.1625},
      {"ImageJ=1.53t\nunit=um\n", 8, 8, 0.125},
      {"ImageJ=1.53t\nunit=\\u00B5m\nmin=0\n", 10, 10, 0.1},
      {"ImageJ=1.53t\nunit=\xC2\xB5m\n", 10, 10, 0.1},
      {"ImageJ=1.53t\nunit=\xB5m\n", 10, 10, 0.1},
      {"ImageJ=1.53t\nunit=nm\n", 0.01, 0.01, 0.1},
      {"ImageJ=1.53t\nunit=mm\n", 10000, 10000, 0.1},
      {"ImageJ=1.53t\nunit=cm\n", 100, 100, 100.0},
      {"ImageJ=1.53t\nunit=inch\n", 300, 300, {}},  // a printer's resolution
      {"ImageJ=1.53t\n", 300, 300, {}},
      {"", 300, 300, {}},  // the same
      {"ImageJ=1.53t\nunit=pixel\n", 1, 1, {}},
      {"ImageJ=1.53t\nunit=um\n", {}, {}, {}},
      {"ImageJ=1.53t\nunit=um\n", 0, 0, {}},
      {"ImageJ=1.53t\nunit=um\n", 5, 4, {}},  // not square
      {"<OME><Pixels PhysicalSizeX=\"0.16\" PhysicalSizeY=\"0.16\"/></OME>", {}, {}, 0.16},
      {"<OME><Pixels PhysicalSizeXUnit=\"nm\" PhysicalSizeX=\"160.0\"/></OME>", {}, {}, 0.16},
      {"<OME><Pixels PhysicalSizeX='0.2' PhysicalSizeXUnit='\xC2\xB5m'/></OME>", 1, 1, 0.2},
      {"<OME><Pixels PhysicalSizeX=\"1\" PhysicalSizeXUnit=\"pixel\"/></OME>", {}, {}, {}},
      {"<OME><Pixels SizeX=\"3\"/></OME>", {}, {}, {}},
      {"[Improvision Data]\r\rXCalibrationMicrons=0.16\rYCalibrationMicrons=0.16\rZCalibrationMicrons=0.35\r",
       {},
       {},
       0.16},
  };
  for (const CalibrationCase& c : cases)
    EXPECT_EQ(pixel_size_um({c.description, c.x_resolution, c.y_resolution, {}}), c.expected_um) << c.description;
}

TEST(Image, a_resolution_counts_if_a_microscope_has_such_pixels) {
  constexpr double kInch_um = 25400, kCentimetre_um = 1e4;
  EXPECT_EQ(pixel_size_um({"SlideBook", 62500, 62500, kCentimetre_um}), 0.16);
  EXPECT_EQ(pixel_size_um({"", 254000, 254000, kInch_um}), 0.1);
  for (const double by_inch : {72, 96, 300, 600})
    EXPECT_EQ(pixel_size_um({"", by_inch, by_inch, kInch_um}), std::nullopt) << by_inch;
  EXPECT_EQ(pixel_size_um({"", 28.35, 28.35, kCentimetre_um}), std::nullopt) << "72 by inch in centimetres";
  EXPECT_EQ(pixel_size_um({"ImageJ=1.53t\nunit=inch\n", 72, 72, kInch_um}), std::nullopt);
  EXPECT_EQ(stated_not_square({"", 100000, 50000, kCentimetre_um}), "0.1 x 0.2 um");
  for (const double other : {100000.0, 28.35}) EXPECT_EQ(stated_not_square({"", 100000, other, kCentimetre_um}), "");
}

std::string error_of(const fs::path& file, int page = 0) {
  const auto error = test::caught<InputError>([&] { read_image(file, page); });
  if (error) EXPECT_EQ(error->where, file.string());
  return error ? error->found : "no error";
}

TEST(Image, what_is_no_image_is_named_for_what_it_is) {
  const TemporaryFolder folder;
  EXPECT_EQ(error_of(folder / "none.tif"), "no such file");
  fs::create_directory(folder / "folder.tif");
  EXPECT_EQ(error_of(folder / "folder.tif"), "a folder");
  std::ofstream(folder / "empty.tif");
  EXPECT_EQ(error_of(folder / "empty.tif"), "an empty file");
  std::ofstream(folder / "zip.tif") << "PK\x03\x04 and so on";
  EXPECT_EQ(error_of(folder / "zip.tif"), "a zip archive");
  std::ofstream(folder / "text.tif") << "bead 1, bead 2";
  EXPECT_EQ(error_of(folder / "text.tif"), "bytes of neither");
  write_tiff(folder / "a.tif", ramp(9, 9));
  EXPECT_EQ(error_of(folder / "a.tif", 3), "1 pages");
  EXPECT_EQ(error_of(folder / "a.tif", -1), "0");
}

/// Overwrite a tag's 4-byte value in a little-endian TIFF.
void set_tag(const fs::path& file, std::uint16_t tag, std::uint32_t value) {
  std::ifstream in(file, std::ios::binary);
  std::string bytes((std::istreambuf_iterator<char>(in)), {});
  std::uint32_t at = 0;
  std::memcpy(&at, &bytes[4], 4);
  std::uint16_t n_tags = 0;
  std::memcpy(&n_tags, &bytes[at], 2);
  for (std::uint32_t entry = at + 2; entry < at + 2 + 12u * n_tags; entry += 12) {
    if (std::memcmp(&bytes[entry], &tag, 2) != 0) continue;
    const std::uint16_t kLong = 4;
    std::memcpy(&bytes[entry + 2], &kLong, 2);
    std::memcpy(&bytes[entry + 8], &value, 4);
  }
  std::ofstream(file, std::ios::binary) << bytes;
}

/// A file of one row of samples.
template <class Sample>
void write_samples(const fs::path& file, const std::vector<Sample>& samples, int format,
                   const std::string& description = {}) {
  TIFF* tiff = TIFFOpen(file.c_str(), "w");
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(samples.size()));
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 1);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, static_cast<int>(8 * sizeof(Sample)));
  TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, format);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  if (!description.empty()) TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, description.c_str());
  std::vector<Sample> row = samples;
  TIFFWriteScanline(tiff, row.data(), 0, 0);
  TIFFClose(tiff);
}

TEST(Image, half_floats_and_long_integers_are_read) {
  const TemporaryFolder folder;
  // IEEE 754: 1, -2, the largest one, the smallest normal one, the smallest of all, 1/3 to ten bits, 0
  write_samples<std::uint16_t>(folder / "half.tif", {0x3C00, 0xC000, 0x7BFF, 0x0400, 0x0001, 0x3555, 0},
                               SAMPLEFORMAT_IEEEFP);
  EXPECT_EQ(read_image(folder / "half.tif").pixels,
            (std::vector<float>{1, -2, 65504, 0x1p-14f, 0x1p-24f, 0x1.554p-2f, 0}));
  write_samples<std::int64_t>(folder / "int64.tif", {0, 7, -3, 1 << 20}, SAMPLEFORMAT_INT);
  EXPECT_EQ(read_image(folder / "int64.tif").pixels, (std::vector<float>{0, 7, -3, 1 << 20}));
  write_samples<std::uint64_t>(folder / "uint64.tif", {0, 7, 1 << 20}, SAMPLEFORMAT_UINT);
  EXPECT_EQ(read_image(folder / "uint64.tif").pixels, (std::vector<float>{0, 7, 1 << 20}));
}

TEST(Image, pixels_without_a_value_are_counted_and_placed) {
  const TemporaryFolder folder;
  const float nan = std::nanf("");
  write_samples<float>(folder / "a.tif", {1, 2, nan, 4, nan}, SAMPLEFORMAT_IEEEFP);
  EXPECT_TRUE(has_words(error_of(folder / "a.tif"), "2 pixels without a value (NaN), the first in column 2, row 0"));
  write_samples<std::uint16_t>(folder / "half.tif", {0x3C00, 0x7E00}, SAMPLEFORMAT_IEEEFP);
  EXPECT_TRUE(has_words(error_of(folder / "half.tif"), "1 pixel without a value"));
}

TEST(Image, an_empty_tag_of_another_program_is_no_damage) {
  const TemporaryFolder folder;
  const std::vector<std::uint16_t> row = {3, 1, 4, 1, 5, 9, 2, 6};
  write_samples(folder / "a.tif", row, SAMPLEFORMAT_UINT);
  std::string bytes = files::read_text(folder / "a.tif");
  // the last tag, which says what is the default, becomes a private one: without a value, or with one beyond the end
  std::uint32_t at = 0;
  std::memcpy(&at, &bytes[4], 4);
  std::uint16_t n_tags = 0;
  std::memcpy(&n_tags, &bytes[at], 2);
  const std::uint32_t last = at + 2 + 12u * (n_tags - 1u), kNone = 0, kBeyond = 1u << 30;
  const std::uint16_t kPrivate = 65000, kByte = 1;
  std::memcpy(&bytes[last], &kPrivate, 2);
  std::memcpy(&bytes[last + 2], &kByte, 2);
  for (const bool is_empty : {true, false}) {
    const std::uint32_t count = is_empty ? kNone : 1000;
    std::memcpy(&bytes[last + 4], &count, 4);
    std::memcpy(&bytes[last + 8], is_empty ? &kNone : &kBeyond, 4);
    files::write_text(folder / "b.tif", bytes);
    EXPECT_EQ(read_image(folder / "b.tif").pixels, std::vector<float>(row.begin(), row.end())) << is_empty;
  }
}

/// One row of indices into these colours.
void write_indexed_png(const fs::path& file, const std::vector<png_color>& palette, std::vector<unsigned char> row) {
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = png_create_info_struct(png);
  std::FILE* stream = std::fopen(file.c_str(), "wb");
  png_init_io(png, stream);
  png_set_IHDR(png, info, static_cast<png_uint_32>(row.size()), 1, 8, PNG_COLOR_TYPE_PALETTE, PNG_INTERLACE_NONE,
               PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  png_set_PLTE(png, info, palette.data(), static_cast<int>(palette.size()));
  png_write_info(png, info);
  png_write_row(png, row.data());
  png_write_end(png, info);
  png_destroy_write_struct(&png, &info);
  std::fclose(stream);
}

TEST(Png, of_indexed_colours_labels_are_the_indices_and_pictures_what_is_seen) {
  const TemporaryFolder folder;
  const std::vector<unsigned char> row = {0, 1, 2, 1};
  const std::vector<png_color> labels = {{0, 0, 0}, {200, 10, 0}, {0, 70, 0}},
                               greys = {{0, 0, 0}, {9, 9, 9}, {5, 5, 5}},
                               brighter = {{0, 0, 0}, {90, 0, 0}, {200, 90, 0}};
  const auto pixels = [&](const std::vector<png_color>& palette, PixelsAre pixels_are) {
    write_indexed_png(folder / "a.png", palette, row);
    return read_image(folder / "a.png", {.pixels = pixels_are}).pixels;
  };
  const std::vector<float> indices = {0, 1, 2, 1};
  EXPECT_EQ(pixels(labels, PixelsAre::labels), indices) << "two colours of one mean are two labels";
  EXPECT_EQ(pixels(labels, PixelsAre::intensities)[1], 70);
  EXPECT_EQ(pixels(brighter, PixelsAre::intensities), indices) << "a lookup table";
  for (const PixelsAre pixels_are : {PixelsAre::labels, PixelsAre::intensities})
    EXPECT_EQ(pixels(greys, pixels_are), (std::vector<float>{0, 9, 5, 9}));
}

TEST(Image, a_calibration_of_a_picture_of_another_size_does_not_count) {
  const TemporaryFolder folder;
  const auto xml = [](int width) {
    return "<?xml version='1.0'?><OME><Image><Pixels SizeX='" + std::to_string(width) +
           "' SizeY='1' PhysicalSizeX='0.1' PhysicalSizeY='0.1'/></Image></OME>";
  };
  const std::vector<std::uint16_t> row(180, 7);
  write_samples(folder / "whole.tif", row, SAMPLEFORMAT_UINT, xml(180));
  write_samples(folder / "binned.tif", row, SAMPLEFORMAT_UINT, xml(360));
  EXPECT_EQ(read_image(folder / "whole.tif").pixel_size_um, 0.1);
  const Channel binned{"binned.tif", read_image(folder / "binned.tif")};
  EXPECT_EQ(binned.image.pixel_size_um, std::nullopt);
  const auto error = test::thrown<InputError>([&] { common_pixel_size_um(binned, binned, std::nullopt); });
  EXPECT_EQ(error.found, "one of 360 x 1 pixels, and the picture has 180 x 1");
  EXPECT_EQ(common_pixel_size_um(binned, binned, 0.2), 0.2);
}

TEST(Image, a_size_the_file_cannot_fill_takes_no_memory) {
  const TemporaryFolder folder;
  write_tiff(folder / "a.tif", ramp(50, 50));
  set_tag(folder / "a.tif", TIFFTAG_IMAGEWIDTH, 2000000000);
  EXPECT_TRUE(has_words(error_of(folder / "a.tif"), "2000000000 x 50 pixels"));
  set_tag(folder / "a.tif", TIFFTAG_IMAGEWIDTH, 40000);
  set_tag(folder / "a.tif", TIFFTAG_IMAGELENGTH, 40000);
  EXPECT_TRUE(has_words(error_of(folder / "a.tif"), "40000 x 40000 pixels"));
  // as many as any file may claim, of 16 bits each: beyond what deflate makes of these few
  set_tag(folder / "a.tif", TIFFTAG_IMAGEWIDTH, 5000);
  set_tag(folder / "a.tif", TIFFTAG_IMAGELENGTH, 5000);
  EXPECT_TRUE(has_words(error_of(folder / "a.tif"), "50000000 of them"));
}

// ---- images of other programs

const fs::path kShared = test::source_folder().parent_path() / "shared/data";

/// What another program (tifffile, else PIL) makes of a file's first page; no extremes where it could not decode it.
struct Decoded {
  std::string file, photometric;
  int width = 0, height = 0, bits = 0, samples = 0;
  std::optional<double> low, high, sum;
};

std::vector<Decoded> decoded_by_others(const fs::path& table) {
  std::ifstream in(table);
  std::string line;
  std::getline(in, line);
  std::vector<Decoded> result;
  while (std::getline(in, line)) {
    std::vector<std::string> fields;
    std::stringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) fields.push_back(cell);
    fields.resize(19);
    Decoded d{.file = fields[0], .photometric = fields[8]};
    const auto whole = [&](int i) { return fields[i].empty() ? 0 : std::stoi(fields[i]); };
    d.width = whole(2);
    d.height = whole(3);
    d.bits = whole(4);
    d.samples = whole(5);
    if (!fields[16].empty()) {
      d.low = std::stod(fields[16]);
      d.high = std::stod(fields[17]);
      d.sum = std::stod(fields[18]);
    }
    result.push_back(d);
  }
  return result;
}

bool has_alpha(const Decoded& d) {
  return (d.samples == 4 && d.photometric == "RGB") || d.file.find("alpha") != std::string::npos;
}

struct Extremes {
  double low = 1e300, high = -1e300, sum = 0;
  void add(const Image& image) {
    for (const float value : image.pixels) {
      low = std::min<double>(low, value);
      high = std::max<double>(high, value);
      sum += value;
    }
  }
};

/// Page 1 of all the channels that it has, transparency left out.
Extremes extremes_of(const fs::path& file, const Decoded& d, double& full_scale) {
  Extremes extremes;
  const int n_channels = has_alpha(d) ? d.samples - 1 : std::max(1, d.samples);
  for (int channel = 1; channel <= n_channels; ++channel) {
    const bool is_one = n_channels == 1;
    const Image image = read_image(file, {.channel = is_one ? "" : std::to_string(channel), .page = 1});
    EXPECT_EQ(image.width, d.width);
    EXPECT_EQ(image.height, d.height);
    full_scale = image.full_scale;
    extremes.add(image);
  }
  return extremes;
}

/// Equal as read; with 0 for white, which mbtfm turns to black and others may leave; or as 8 bits, to which PIL expands
/// fewer. To rounding: pixels are floats of 24 bits here.
bool is_equal(const Extremes& e, const Decoded& d, double full_scale) {
  const double n = static_cast<double>(d.width) * d.height;
  const auto is_same = [&](double low, double high, double sum) {
    const auto is_near = [](double a, double b) { return std::abs(a - b) <= 1e-6 * std::abs(b) + 1e-3; };
    return is_near(low, *d.low) && is_near(high, *d.high) && is_near(sum, *d.sum);
  };
  const double k = 255 / full_scale;
  return is_same(e.low, e.high, e.sum) ||
         (d.photometric == "MINISWHITE" && is_same(full_scale - e.high, full_scale - e.low, full_scale * n - e.sum)) ||
         (d.bits < 8 && is_same(k * e.low, k * e.high, k * e.sum));
}

TEST(Image, real_files_decode_as_by_other_programs_or_are_refused) {
  if (!fs::exists(kShared / "tiff")) GTEST_SKIP() << "the images of other programs are not here";
  int n_equal = 0, n_without_reference = 0;
  std::string refused;
  for (const Decoded& d : decoded_by_others(kShared / "tiff/reference_decode_open.csv")) {
    if (!fs::exists(kShared / d.file)) continue;
    SCOPED_TRACE(d.file);
    try {
      double full_scale = 0;
      const Extremes found = extremes_of(kShared / d.file, d, full_scale);
      if (!d.sum || has_alpha(d)) {  // theirs holds the transparency as well
        ++n_without_reference;
        continue;
      }
      EXPECT_TRUE(is_equal(found, d, full_scale)) << found.low << " " << found.high << " " << found.sum;
      ++n_equal;
    } catch (const InputError& error) {
      refused += d.file + ": " + error.expected + ", found " + error.found + (d.sum ? "" : " (nor by others)") + "\n";
    }
  }
  RecordProperty("equal", n_equal);
  RecordProperty("decoded_here_only", n_without_reference);
  RecordProperty("refused", refused);
  std::printf("%d equal, %d decoded here only, refused:\n%s", n_equal, n_without_reference, refused.c_str());
}

TEST(Image, real_calibrations_are_found) {
  if (!fs::exists(kShared / "tiff")) GTEST_SKIP() << "the images of other programs are not here";
  const std::pair<const char*, std::optional<double>> cases[] = {
      {"tiff/imagej153t/hyperstack_c2z3t4_16bit_micron.tif", 0.1625},
      {"tiff/imagej153t/inch300.tif", std::nullopt},
      {"tiff/imagej153t/lut8_cm.tif", 100.0},
      {"tiff/imagej153t/rgb_nm.tif", 0.0650026},
      {"tiff/imagej153t/stack7_16bit_mu_sign.tif", 0.1},
      {"tiff/imagej153t/uncalibrated_8bit.tif", std::nullopt},
      {"tiff/derived_tiffcp/beads_2ch.ome.tif", 0.16},
      {"tiff/derived_tiffcp/beads_2ch_nm.ome.tif", 0.16},
      {"tiff/derived_tiffcp/beads_16_none.tif", std::nullopt},
      {"actin/micropattern_chirality/Control/0001_20Feb20_siNT.tif", 0.16},
      {"actin/bronchial_monolayer/U13_72_P1_5_SF.tif", 0.293}};
  for (const auto& [file, expected] : cases) {
    const auto found = read_image(kShared / file, {.page = 1}).pixel_size_um;
    ASSERT_EQ(found.has_value(), expected.has_value()) << file;
    EXPECT_NEAR(found.value_or(0), expected.value_or(0), 1e-5 * expected.value_or(0)) << file;
  }
  EXPECT_EQ(read_image(kShared / "tiff/derived_tiffcp/beads_2ch.ome.tif", {.page = 2}).pixel_size_um, 0.16);
}

TEST(Jpeg, is_read_as_what_it_shows_and_marked_as_lossy) {
  const test::TemporaryFolder folder;
  Picture picture{.width = 64, .height = 48};
  for (int j = 0; j < 48; ++j)
    for (int i = 0; i < 64; ++i)
      for (const int value : {2 * i + 40, 2 * i + 40, 2 * i + 40})
        picture.rgb.push_back(static_cast<std::uint8_t>(value));
  write_jpeg(folder / "a.jpg", picture);
  const Image image = read_image(folder / "a.jpg");
  ASSERT_EQ(image.width, 64);
  ASSERT_EQ(image.height, 48);
  EXPECT_EQ(image.full_scale, 255);
  EXPECT_TRUE(image.is_lossy);
  EXPECT_FALSE(image.pixel_size_um) << "its resolution is a printer's";
  // an even slope has few waves: at quality 80 these are rounded to steps of some counts
  for (int j = 0; j < 48; ++j)
    for (int i = 0; i < 64; ++i) EXPECT_NEAR(image.at(i, j), 2 * i + 40, 6) << i << ", " << j;
  EXPECT_TRUE(binned(image, 2).is_lossy);
  EXPECT_TRUE(fires("lossy-image", noticed_loss({"a.jpg", image})));
  write_tiff(folder / "a.tif", image);
  EXPECT_FALSE(fires("lossy-image", noticed_loss({"a.tif", read_image(folder / "a.tif")})));
  EXPECT_EQ(read_image(folder / "a.jpg", {.channel = "red"}).width, 64);
  EXPECT_THROW(read_image(folder / "a.jpg", {.channel = "4"}), InputError);
  EXPECT_THROW(read_image(folder / "a.jpg", {.page = 2}), InputError);
}

TEST(Channels, a_pixel_size_that_no_image_states_is_named) {
  const Channel with{"a.tif", {.width = 1, .height = 1, .pixels = {0}, .pixel_size_um = 0.1}},
      without{"b.tif", {.width = 1, .height = 1, .pixels = {0}}};
  EXPECT_TRUE(fires("pixel-size-unchecked", noticed_unchecked({&without}, 0.2)));
  EXPECT_FALSE(fires("pixel-size-unchecked", noticed_unchecked({&without, &with}, 0.2)));
  EXPECT_FALSE(fires("pixel-size-unchecked", noticed_unchecked({}, 0.2)));
}

TEST(Channels, a_pixel_size_given_is_compared_with_each_images_own_binned_or_not) {
  Image image = ramp(64, 48);
  EXPECT_FALSE(doubt_about_calibration({"a.tif", image}, 0.1)) << "the image has none";
  image.pixel_size_um = 0.1;
  EXPECT_FALSE(doubt_about_calibration({"a.tif", image}, std::nullopt)) << "nothing is given";
  EXPECT_FALSE(doubt_about_calibration({"a.tif", image}, 0.1));
  EXPECT_FALSE(doubt_about_calibration({"a.tif", binned(image, 2)}, 0.2)) << "of binned pixels both";
  EXPECT_EQ(doubt_about_calibration({"a.tif", image}, 0.105)->level, stage::DoubtLevel::caution);
  EXPECT_EQ(doubt_about_calibration({"a.tif", image}, 0.2)->level, stage::DoubtLevel::refused);
}

TEST(Channels, a_saturated_image_is_noticed_by_the_share_of_its_pixels_at_the_largest_value) {
  Image image = ramp(100, 100);
  EXPECT_FALSE(fires("saturated", noticed_saturation({"a.tif", image})));
  const float brightest = *std::max_element(image.pixels.begin(), image.pixels.end());
  for (int i = 0; i < 50; ++i) image.at(i, 7) = brightest + 1;
  const auto found = noticed_saturation({"a.tif", image});
  ASSERT_TRUE(fires("saturated", found));
  EXPECT_NEAR(*found->number, 0.005, 1e-12);
  EXPECT_TRUE(has_words(found->text, "a.tif is saturated: 0.5 % of its pixels"));
}

TEST(Channels, rows_that_were_lost_are_noticed_and_a_dark_ground_or_a_border_is_not) {
  Image image = ramp(60, 40);
  for (float& value : image.pixels) value += 100;
  const auto warns = [](const Image& of) {
    return std::ranges::any_of(noticed_in({"a.tif", of}), [](const std::optional<Finding>& found) {
      return found && found->severity == Severity::caution && has_words(found->text, "Rows 11 to 13 of a.tif");
    });
  };
  EXPECT_FALSE(warns(image));
  Image lost = image;
  for (int j = 10; j < 13; ++j)
    for (int i = 0; i < lost.width; ++i) lost.at(i, j) = 0;
  EXPECT_TRUE(warns(lost));
  Image dark = lost;
  dark.at(7, 30) = 0;
  EXPECT_FALSE(warns(dark)) << "a ground that was subtracted is 0 elsewhere, too";
  Image border = image;
  for (int j = 10; j < border.height; ++j)
    for (int i = 0; i < border.width; ++i) border.at(i, j) = 0;
  EXPECT_FALSE(warns(border)) << "padding";
}

TEST(Channels, beads_of_another_field_are_refused_with_what_would_make_it_one) {
  struct Case {
    const char* what;
    ImageField cell, beads;
    const char* remedy;  ///< none: it is one field
  };
  const std::vector<Case> cases = {
      {"alike", {1024, 1024, 0.1}, {1024, 1024, 0.1}, nullptr},
      {"no pixel sizes known", {1024, 800, {}}, {1024, 800, {}}, nullptr},
      {"binned, and both say so", {1024, 1024, 0.1}, {512, 512, 0.2}, nullptr},
      {"binned, a column over", {1025, 1024, 0.1}, {512, 512, 0.2}, nullptr},
      {"calibrations as a file rounds them", {1024, 1024, 0.1}, {1024, 1024, 0.1001}, nullptr},
      {"binned untold", {1024, 1024, 0.1}, {512, 512, {}}, "track.beads_pixel_size_um = 0.2"},
      {"binned by three, rows over", {1024, 1022, 0.1}, {341, 340, {}}, "track.beads_pixel_size_um = 0.3"},
      {"twice as many", {512, 512, 0.2}, {1024, 1024, {}}, "track.beads_pixel_size_um = 0.1"},
      {"half of the image", {1024, 1024, 0.1}, {1024, 512, {}}, "crop all images"},
      {"a border cut off", {1024, 1024, 0.1}, {1000, 1000, 0.1}, "crop all images"},
      {"another pixel size", {1024, 1024, 0.1}, {1024, 1024, 0.2}, "set pixel_size_um"},
  };
  for (const Case& c : cases) {
    SCOPED_TRACE(c.what);
    try {
      require_same_field({"actin.tif", c.cell}, {"beads.tif", c.beads});
      EXPECT_EQ(c.remedy, nullptr) << "not refused";
    } catch (const InputError& error) {
      const std::string said = error.what() + error.hint;
      ASSERT_NE(c.remedy, nullptr) << said;
      EXPECT_TRUE(has_words(said, std::string(c.remedy), std::string("beads.tif"), std::string("actin.tif"),
                            std::to_string(c.beads.width) + " x " + std::to_string(c.beads.height)));
    }
  }
}

}  // namespace
}  // namespace mbtfm::images
