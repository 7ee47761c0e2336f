#include "segment/image.h"

#include <gtest/gtest.h>
#include <tiffio.h>

#include <algorithm>
#include <cstring>
#include <fstream>
#include <sstream>

#include "pipeline/contract/errors.h"
#include "segment/image_file.h"
#include "segment/png.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::segment {
namespace {

namespace fs = std::filesystem;
using test::TemporaryFolder;

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

TEST(Image, values_outside_16_bits_are_clamped_and_fractions_rounded) {
  const TemporaryFolder folder;
  Image image{.width = 4, .height = 1, .pixels = {-3.0f, 1.5f, 70000.0f, 2.4f}, .pixel_size_um = {}, .full_scale = 0};
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
      {"ImageJ=1.53t\nunit=inch\n", 300, 300, 84.6667},
      {"ImageJ=1.53t\n", 300, 300, {}},  // a printer's resolution
      {"", 300, 300, {}},                // the same
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
  for (const CalibrationCase& c : cases) {
    EXPECT_EQ(pixel_size_um({c.description, c.x_resolution, c.y_resolution}), c.expected_um) << c.description;
  }
}

std::string error_of(const fs::path& file, int page = 0) {
  try {
    read_image(file, page);
  } catch (const InputError& error) {
    EXPECT_EQ(error.where, file.string());
    return error.found;
  }
  return "no error";
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

// ---- planes: each page of these files is filled with its own number

/// A TIFF of 8-bit pages of 4 x 3 pixels, page k filled with k; the first has the description.
void write_pages(const fs::path& file, int n_pages, const std::string& description, int n_samples = 1) {
  TIFF* tiff = TIFFOpen(file.c_str(), "w");
  for (int page = 0; page < n_pages; ++page) {
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 4);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 3);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 8);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, n_samples);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    if (page == 0 && !description.empty()) TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, description.c_str());
    std::vector<unsigned char> row(4 * static_cast<std::size_t>(n_samples));
    for (std::size_t i = 0; i < row.size(); ++i) row[i] = static_cast<unsigned char>(page + 100 * (i % n_samples));
    for (std::uint32_t j = 0; j < 3; ++j) TIFFWriteScanline(tiff, row.data(), j, 0);
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
}

/// The one value of the image that is read.
float value_of(const fs::path& file, const PlaneChoice& choice) {
  const Image image = read_image(file, choice);
  for (const float value : image.pixels) EXPECT_EQ(value, image.pixels.front());
  return image.pixels.front();
}

std::string refusal(const fs::path& file, const PlaneChoice& choice) {
  try {
    read_image(file, choice);
  } catch (const InputError& error) {
    return error.expected + ", found " + error.found + "; " + error.hint;
  }
  return "no error";
}

TEST(ImagePlanes, imagej_stores_channels_fastest_then_slices_then_frames) {
  const TemporaryFolder folder;
  const fs::path file = folder / "a.tif";
  write_pages(file, 24, "ImageJ=1.53t\nimages=24\nchannels=2\nslices=3\nframes=4\nhyperstack=true\n");
  for (int t = 0; t < 4; ++t)
    for (int z = 0; z < 3; ++z)
      for (int c = 0; c < 2; ++c)
        EXPECT_EQ(value_of(file, {.channel = std::to_string(c + 1), .z = std::to_string(z + 1), .time = t + 1}),
                  static_cast<float>((t * 3 + z) * 2 + c));
  EXPECT_EQ(value_of(file, {.channel = "2", .time = 4}), 23);  // the brightest slice
  EXPECT_EQ(value_of(file, {.page = 8}), 7);
}

TEST(ImagePlanes, an_imagej_stack_without_dimensions_is_one_of_slices) {
  const TemporaryFolder folder;
  write_pages(folder / "a.tif", 5, "ImageJ=1.53t\nimages=5\n");
  EXPECT_EQ(value_of(folder / "a.tif", {}), 4);
  EXPECT_EQ(value_of(folder / "a.tif", {.z = "2"}), 1);
}

TEST(ImagePlanes, a_file_that_states_no_dimensions_is_read_by_pages) {
  const TemporaryFolder folder;
  write_pages(folder / "a.tif", 5, "");
  EXPECT_EQ(value_of(folder / "a.tif", {}), 0);
  EXPECT_EQ(value_of(folder / "a.tif", {.page = 4}), 3);
  EXPECT_EQ(read_image(folder / "a.tif", 3).pixels.front(), 3);
  EXPECT_NE(refusal(folder / "a.tif", {.page = 6}).find("found 5 pages"), std::string::npos);
  EXPECT_NE(refusal(folder / "a.tif", {.time = 2}).find("found 1 frame"), std::string::npos);
}

std::string ome(const std::string& pixels, const std::string& inside) {
  return "<?xml version=\"1.0\"?><OME UUID=\"urn:uuid:a\"><Image ID=\"Image:0\"><Pixels " + pixels + ">" + inside +
         "</Pixels></Image><Image ID=\"Image:1\"><Pixels SizeC=\"1\" SizeZ=\"1\" SizeT=\"1\"/></Image></OME>";
}

TEST(ImagePlanes, ome_states_which_dimension_runs_fastest) {
  const TemporaryFolder folder;
  const fs::path file = folder / "a.ome.tif";
  const int sizes[3] = {2, 3, 2};  // C, Z, T
  for (const std::string order : {"XYCZT", "XYCTZ", "XYZCT", "XYZTC", "XYTCZ", "XYTZC"}) {
    fs::remove(file);
    write_pages(file, 12, ome("DimensionOrder='" + order + "' SizeC='2' SizeZ='3' SizeT='2'", ""));
    for (int c = 0; c < 2; ++c)
      for (int z = 0; z < 3; ++z)
        for (int t = 0; t < 2; ++t) {
          int page = 0, step = 1;
          for (const char axis : order.substr(2)) {
            page += step * (axis == 'C' ? c : axis == 'Z' ? z : t);
            step *= sizes[axis == 'C' ? 0 : axis == 'Z' ? 1 : 2];
          }
          EXPECT_EQ(value_of(file, {.channel = std::to_string(c + 1), .z = std::to_string(z + 1), .time = t + 1}),
                    static_cast<float>(page))
              << order;
        }
  }
}

TEST(ImagePlanes, ome_pages_may_lie_in_any_order) {
  const TemporaryFolder folder;
  const fs::path file = folder / "a.ome.tif";
  write_pages(
      file, 4,
      ome("DimensionOrder='XYCZT' SizeC='2' SizeZ='2' SizeT='1'",
          "<TiffData FirstC='1' IFD='0'/><TiffData FirstC='0' IFD='3'/>"
          "<TiffData FirstZ='1' IFD='1' PlaneCount='2'><UUID FileName='other.tif'>urn:uuid:a</UUID></TiffData>"));
  EXPECT_EQ(value_of(file, {.channel = "2", .z = "1"}), 0);
  EXPECT_EQ(value_of(file, {.channel = "1", .z = "1"}), 3);
  EXPECT_EQ(value_of(file, {.channel = "1", .z = "2"}), 1);
  EXPECT_EQ(value_of(file, {.channel = "2"}), 2);
}

TEST(ImagePlanes, a_plane_in_another_file_of_an_ome_set_is_an_error) {
  const TemporaryFolder folder;
  write_pages(folder / "a.ome.tif", 1,
              ome("SizeC='2' SizeZ='1' SizeT='1'",
                  "<TiffData IFD='0'><UUID FileName='a.ome.tif'>urn:uuid:a</UUID></TiffData>"
                  "<TiffData FirstC='1' IFD='0'><UUID FileName='b.ome.tif'>urn:uuid:b</UUID></TiffData>"));
  EXPECT_EQ(value_of(folder / "a.ome.tif", {.channel = "1"}), 0);
  EXPECT_NE(refusal(folder / "a.ome.tif", {.channel = "2"}).find("another file of the set"), std::string::npos);
}

TEST(ImagePlanes, channels_are_called_by_name_and_listed_where_none_was_chosen) {
  const TemporaryFolder folder;
  const fs::path file = folder / "a.ome.tif";
  write_pages(
      file, 3,
      ome("SizeC='3' SizeZ='1' SizeT='1'", "<Channel Name='Paxillin'/><Channel Name='actin &amp; more'/><Channel/>"));
  EXPECT_EQ(value_of(file, {.channel = "actin & more"}), 1);
  EXPECT_EQ(value_of(file, {.channel = "paxillin"}), 0);
  EXPECT_EQ(value_of(file, {.channel = "3"}), 2);
  EXPECT_EQ(refusal(file, {.prefix = "actin"}),
            "the channel to be chosen, found 3 channels: 1 'Paxillin', 2 'actin & more', 3; set actin_channel to the "
            "number or name of one");
  EXPECT_NE(refusal(file, {.channel = "dapi"}).find("3 channels: 1 'Paxillin'"), std::string::npos);
  EXPECT_NE(refusal(file, {.channel = "4"}).find("3 channels"), std::string::npos);
}

TEST(ImagePlanes, frames_must_be_chosen_and_slices_be_there) {
  const TemporaryFolder folder;
  const fs::path file = folder / "a.tif";
  write_pages(file, 6, "ImageJ=1.53t\nimages=6\nslices=3\nframes=2\n");
  EXPECT_NE(refusal(file, {.prefix = "actin"}).find("2 frames; set actin_time"), std::string::npos);
  EXPECT_NE(refusal(file, {.time = 3}).find("2 frames"), std::string::npos);
  EXPECT_NE(refusal(file, {.z = "4", .time = 1}).find("3 slices"), std::string::npos);
  EXPECT_NE(refusal(file, {.z = "mean", .time = 1}).find("3 slices"), std::string::npos);
  EXPECT_EQ(value_of(file, {.time = 2}), 5);
}

TEST(ImagePlanes, samples_of_a_pixel_are_channels) {
  const TemporaryFolder folder;
  write_pages(folder / "a.tif", 1, "", 2);
  EXPECT_EQ(value_of(folder / "a.tif", {.channel = "2"}), 100);
  EXPECT_NE(refusal(folder / "a.tif", {}).find("2 channels"), std::string::npos);
}

TEST(ImagePlanes, contradicting_dimensions_are_an_error_but_pages_can_still_be_read) {
  const TemporaryFolder folder;
  int n = 0;
  for (const std::string& description :
       {std::string("ImageJ=1.53t\nimages=4\nchannels=3\n"), std::string("ImageJ=1.53t\nimages=4\nchannels=x\n"),
        ome("SizeC='2' SizeZ='x'", ""), ome("SizeC='4194304' SizeZ='4194304'", ""), ome("DimensionOrder='XYCCC'", ""),
        std::string("<OME><Image><Pixels SizeC='2'"),
        std::string("<OME><BinaryOnly MetadataFile='a.companion'/></OME>")}) {
    const fs::path file = folder / (std::to_string(n++) + ".tif");
    write_pages(file, 4, description);
    EXPECT_NE(refusal(file, {}).find("set image_page"), std::string::npos) << description;
    EXPECT_EQ(value_of(file, {.page = 3}), 2);
  }
}

TEST(ImagePlanes, more_than_4_GB_of_imagej_are_planes_after_the_only_page) {
  // as ij.io.TiffEncoder writes it: big-endian, tags first, then the planes without pages of their own
  const TemporaryFolder folder;
  const auto stack = [&](int bits, int n_planes_there) {
    const std::string description = "ImageJ=1.53t\nimages=6\nchannels=2\nslices=3\nhyperstack=true\n";
    std::string bytes = {'M', 'M', 0, 42, 0, 0, 0, 8};
    const auto number = [&](std::uint32_t value, int n_bytes) {
      for (int i = n_bytes - 1; i >= 0; --i) bytes += static_cast<char>(value >> 8 * i);
    };
    const std::uint32_t n_tags = 8, at_text = 8 + 2 + 12 * n_tags + 4,
                        at_pixels = at_text + static_cast<std::uint32_t>(description.size()) + 1;
    const auto tag = [&](std::uint32_t name, std::uint32_t value, std::uint32_t type = 4, std::uint32_t count = 1) {
      number(name, 2);
      number(type, 2);
      number(count, 4);
      number(value, 4);
    };
    number(n_tags, 2);
    tag(TIFFTAG_IMAGEWIDTH, 4);
    tag(TIFFTAG_IMAGELENGTH, 3);
    tag(TIFFTAG_BITSPERSAMPLE, static_cast<std::uint32_t>(bits));
    tag(TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    tag(TIFFTAG_IMAGEDESCRIPTION, at_text, 2, static_cast<std::uint32_t>(description.size()) + 1);
    tag(TIFFTAG_STRIPOFFSETS, at_pixels);
    tag(TIFFTAG_ROWSPERSTRIP, 3);
    tag(TIFFTAG_STRIPBYTECOUNTS, static_cast<std::uint32_t>(12 * bits / 8));
    number(0, 4);
    bytes += description + '\0';
    for (std::uint32_t plane = 0; plane < static_cast<std::uint32_t>(n_planes_there); ++plane)
      for (int i = 0; i < 12; ++i) number(plane + (bits == 16 ? 1000 : 0), bits / 8);
    const fs::path file = folder / (std::to_string(bits) + "_" + std::to_string(n_planes_there) + ".tif");
    std::ofstream(file, std::ios::binary) << bytes;
    return file;
  };
  for (const int bits : {8, 16, 32}) {
    const float base = bits == 16 ? 1000 : 0;
    for (int z = 0; z < 3; ++z)
      for (int c = 0; c < 2; ++c)
        EXPECT_EQ(value_of(stack(bits, 6), {.channel = std::to_string(c + 1), .z = std::to_string(z + 1)}),
                  base + static_cast<float>(2 * z + c));
    EXPECT_EQ(value_of(stack(bits, 6), {.page = 5}), base + 4);
    EXPECT_NE(refusal(stack(bits, 5), {.channel = "2", .z = "3"}).find("plane 6 at bytes"), std::string::npos);
  }
}

TEST(Image, a_size_the_file_cannot_fill_takes_no_memory) {
  const TemporaryFolder folder;
  write_tiff(folder / "a.tif", ramp(50, 50));
  set_tag(folder / "a.tif", TIFFTAG_IMAGEWIDTH, 2000000000);
  EXPECT_NE(error_of(folder / "a.tif").find("2000000000 x 50 pixels"), std::string::npos);
  set_tag(folder / "a.tif", TIFFTAG_IMAGEWIDTH, 40000);
  set_tag(folder / "a.tif", TIFFTAG_IMAGELENGTH, 40000);
  EXPECT_NE(error_of(folder / "a.tif").find("40000 x 40000 pixels"), std::string::npos);
}

// ---- images of other programs

const fs::path kShared = fs::path(MBTFM_SOURCE_DIR).parent_path() / "shared/data";

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
    Decoded d{.file = fields[0], .photometric = fields[8], .low = {}, .high = {}, .sum = {}};
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

TEST(ImagePlanes, real_hyperstacks_are_read_as_by_another_program) {
  if (!fs::exists(kShared / "tiff")) GTEST_SKIP() << "the images of other programs are not here";
  struct Case {
    const char* file;
    PlaneChoice choice;
    double sum;  // of the maximum over the slices, by tifffile and numpy
  };
  const fs::path hyperstack = "tiff/imagej153t/hyperstack_c2z3t4_16bit_micron.tif",
                 series = "tiff/vips/multi-channel-z-series.ome.tif";
  const Case cases[] = {{hyperstack.c_str(), {.channel = "1", .time = 1}, 167070},
                        {hyperstack.c_str(), {.channel = "2", .time = 1}, 264070},
                        {hyperstack.c_str(), {.channel = "2", .time = 4}, 266980},
                        {series.c_str(), {.channel = "1"}, 3462130},
                        {series.c_str(), {.channel = "2"}, 3461875},
                        {series.c_str(), {.channel = "3"}, 3461744},
                        {"tiff/derived_tiffcp/beads_2ch.ome.tif", {.channel = "ch A"}, 4415260968}};
  for (const Case& c : cases) {
    Extremes found;
    found.add(read_image(kShared / c.file, c.choice));
    EXPECT_EQ(found.sum, c.sum) << c.file << " channel " << c.choice.channel;
  }
}

TEST(Image, real_calibrations_are_found) {
  if (!fs::exists(kShared / "tiff")) GTEST_SKIP() << "the images of other programs are not here";
  const std::pair<const char*, std::optional<double>> cases[] = {
      {"tiff/imagej153t/hyperstack_c2z3t4_16bit_micron.tif", 0.1625},
      {"tiff/imagej153t/inch300.tif", 84.6667},
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

}  // namespace
}  // namespace mbtfm::segment
