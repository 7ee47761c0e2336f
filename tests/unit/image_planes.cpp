/// Which plane of a file is read. Each page of the files made here is filled with its own number.
#include <tiffio.h>

#include "pipeline/contract/errors.h"
#include "segment/images/image.h"
#include "tests/support/folders.h"
#include "tests/support/temporary_folder.h"

namespace mbtfm::images {
namespace {

/// A TIFF of 8-bit pages of 4 x 3 pixels, page k filled with k; the first has the description.
void write_pages(const fs::path& file, int n_pages, const std::string& description, int n_samples = 1,
                 int orientation = ORIENTATION_TOPLEFT) {
  TIFF* tiff = TIFFOpen(file.c_str(), "w");
  for (int page = 0; page < n_pages; ++page) {
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 4);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 3);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 8);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, n_samples);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff, TIFFTAG_ORIENTATION, orientation);
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
  const auto error = test::caught<InputError>([&] { read_image(file, choice); });
  return error ? error->expected + ", found " + error->found + "; " + error->hint : "no error";
}

using ImagePlanes = test::InFolder;

TEST_F(ImagePlanes, imagej_stores_channels_fastest_then_slices_then_frames) {
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

TEST_F(ImagePlanes, an_imagej_stack_without_dimensions_is_one_of_slices) {
  write_pages(folder / "a.tif", 5, "ImageJ=1.53t\nimages=5\n");
  EXPECT_EQ(value_of(folder / "a.tif", {}), 4);
  EXPECT_EQ(value_of(folder / "a.tif", {.z = "2"}), 1);
}

TEST_F(ImagePlanes, a_file_that_states_no_dimensions_is_read_by_pages) {
  write_pages(folder / "a.tif", 5, "");
  EXPECT_EQ(value_of(folder / "a.tif", {}), 0);
  EXPECT_EQ(value_of(folder / "a.tif", {.page = 4}), 3);
  EXPECT_EQ(read_image(folder / "a.tif", 3).pixels.front(), 3);
  EXPECT_TRUE(has_words(refusal(folder / "a.tif", {.page = 6}), "found 5 pages"));
  EXPECT_TRUE(has_words(refusal(folder / "a.tif", {.time = 2}), "found 1 frame"));
}

std::string ome(const std::string& pixels, const std::string& inside) {
  return "<?xml version=\"1.0\"?><OME UUID=\"urn:uuid:a\"><Image ID=\"Image:0\"><Pixels " + pixels + ">" + inside +
         "</Pixels></Image><Image ID=\"Image:1\"><Pixels SizeC=\"1\" SizeZ=\"1\" SizeT=\"1\"/></Image></OME>";
}

TEST_F(ImagePlanes, ome_states_which_dimension_runs_fastest) {
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

TEST_F(ImagePlanes, ome_pages_may_lie_in_any_order) {
  const fs::path file = folder / "a.ome.tif";
  write_pages(file, 4,
              ome("DimensionOrder='XYCZT' SizeC='2' SizeZ='2' SizeT='1'",
                  "<TiffData FirstC='1' IFD='0'/><TiffData FirstC='0' IFD='3'/><TiffData FirstZ='1' IFD='1' "
                  "PlaneCount='2'><UUID FileName='other.tif'>urn:uuid:a</UUID></TiffData>"));
  EXPECT_EQ(value_of(file, {.channel = "2", .z = "1"}), 0);
  EXPECT_EQ(value_of(file, {.channel = "1", .z = "1"}), 3);
  EXPECT_EQ(value_of(file, {.channel = "1", .z = "2"}), 1);
  EXPECT_EQ(value_of(file, {.channel = "2"}), 2);
}

TEST_F(ImagePlanes, a_plane_in_another_file_of_an_ome_set_is_an_error) {
  write_pages(folder / "a.ome.tif", 1,
              ome("SizeC='2' SizeZ='1' SizeT='1'",
                  "<TiffData IFD='0'><UUID FileName='a.ome.tif'>urn:uuid:a</UUID></TiffData><TiffData FirstC='1' "
                  "IFD='0'><UUID FileName='b.ome.tif'>urn:uuid:b</UUID></TiffData>"));
  EXPECT_EQ(value_of(folder / "a.ome.tif", {.channel = "1"}), 0);
  EXPECT_TRUE(has_words(refusal(folder / "a.ome.tif", {.channel = "2"}), "another file of the set"));
}

TEST_F(ImagePlanes, a_renamed_file_of_ome_is_the_one_whose_planes_it_has) {
  const auto named = [](const std::string& file, int first, int n) {
    return "<TiffData FirstT='" + std::to_string(first) + "' IFD='0' PlaneCount='" + std::to_string(n) +
           "'><UUID FileName='" + file + "'>urn:uuid:" + file + "</UUID></TiffData>";
  };
  write_pages(folder / "one.tif", 2, ome("SizeC='1' SizeZ='1' SizeT='2'", named("old.ome.tif", 0, 2)));
  EXPECT_EQ(value_of(folder / "one.tif", {.time = 2}), 1) << "the only file named";
  const std::string set = named("a.ome.tif", 0, 1) + named("b.ome.tif", 1, 2);
  write_pages(folder / "second.tif", 2, ome("SizeC='1' SizeZ='1' SizeT='3'", set));
  EXPECT_EQ(value_of(folder / "second.tif", {.time = 2}), 0) << "as many pages as b has planes";
  EXPECT_EQ(value_of(folder / "second.tif", {.time = 3}), 1);
  EXPECT_TRUE(has_words(refusal(folder / "second.tif", {.time = 1}), "another file of the set"));
  write_pages(folder / "whole.tif", 3, ome("SizeC='1' SizeZ='1' SizeT='3'", set));
  EXPECT_EQ(value_of(folder / "whole.tif", {.time = 1}), 0) << "put into one file";
  EXPECT_EQ(value_of(folder / "whole.tif", {.time = 3}), 2);
  const std::string alike = named("a.ome.tif", 0, 2) + named("b.ome.tif", 2, 2);
  write_pages(folder / "either.tif", 2, ome("SizeC='1' SizeZ='1' SizeT='4'", alike));
  EXPECT_TRUE(has_words(refusal(folder / "either.tif", {.time = 1}), "a.ome.tif, b.ome.tif"));
}

TEST_F(ImagePlanes, an_aborted_recording_has_the_frames_that_are_there) {
  write_pages(folder / "a.tif", 3, ome("SizeC='1' SizeZ='1' SizeT='100'", "<TiffData IFD='0' PlaneCount='100'/>"));
  EXPECT_EQ(value_of(folder / "a.tif", {.time = 3}), 2);
  EXPECT_TRUE(has_words(refusal(folder / "a.tif", {.time = 4}), "3 frames of the 100 that it states"));
  EXPECT_TRUE(has_words(refusal(folder / "a.tif", {}), "_time to a number from 1 to 3"));
  write_pages(folder / "one.tif", 1, ome("SizeC='1' SizeZ='1' SizeT='100'", ""));
  EXPECT_EQ(value_of(folder / "one.tif", {}), 0) << "the only one";
}

TEST_F(ImagePlanes, images_with_an_interval_between_them_are_frames) {
  write_pages(folder / "a.tif", 5, "ImageJ=1.53t\nimages=5\nslices=5\nfinterval=30.0\n");
  EXPECT_TRUE(has_words(refusal(folder / "a.tif", {}), "the frame to be chosen")) << "not their maximum";
  EXPECT_EQ(value_of(folder / "a.tif", {.time = 2}), 1);
  write_pages(folder / "z.tif", 5, "ImageJ=1.53t\nimages=5\nslices=5\nfinterval=30.0\nspacing=0.3\n");
  EXPECT_EQ(value_of(folder / "z.tif", {}), 4);
}

TEST_F(ImagePlanes, what_was_taken_of_several_planes_is_said) {
  write_pages(folder / "pages.tif", 5, "");
  write_pages(folder / "slices.tif", 3, "ImageJ=1.53t\nimages=3\nslices=3\n");
  write_pages(folder / "one.tif", 1, "");
  EXPECT_TRUE(has_words(read_image(folder / "pages.tif").taken, "5 pages"));
  EXPECT_TRUE(has_words(read_image(folder / "slices.tif").taken, "maximum of its 3 slices"));
  EXPECT_EQ(read_image(folder / "slices.tif", {.z = "2"}).taken, "");
  EXPECT_EQ(read_image(folder / "one.tif").taken, "");
  write_pages(folder / "turned.tif", 1, "", 1, ORIENTATION_RIGHTTOP);
  EXPECT_TRUE(has_words(read_image(folder / "turned.tif").taken, "orientation tag (6)"));
  write_pages(folder / "two.ome.tif", 2, ome("SizeC='1' SizeZ='1' SizeT='1'", "<TiffData IFD='0'/>"));
  EXPECT_TRUE(has_words(read_image(folder / "two.ome.tif").taken, "several images"));
}

/// A page of 4 x 3 pixels, and before it one of half of its size.
void write_with_thumbnail(const fs::path& file) {
  TIFF* tiff = TIFFOpen(file.c_str(), "w");
  for (const std::uint32_t side : {2u, 4u}) {
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, side);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, side);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 8);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
    if (side == 2) TIFFSetField(tiff, TIFFTAG_SUBFILETYPE, FILETYPE_REDUCEDIMAGE);
    std::vector<unsigned char> row(side, static_cast<unsigned char>(side));
    for (std::uint32_t j = 0; j < side; ++j) TIFFWriteScanline(tiff, row.data(), j, 0);
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
}

TEST_F(ImagePlanes, a_thumbnail_is_not_the_picture) {
  write_with_thumbnail(folder / "a.tif");
  EXPECT_EQ(value_of(folder / "a.tif", {}), 4);
  EXPECT_EQ(read_field(folder / "a.tif").width, 4);
  EXPECT_EQ(value_of(folder / "a.tif", {.page = 1}), 2) << "a page that is asked for";
}

TEST_F(ImagePlanes, ome_describes_each_plane_once_and_each_slice_has_a_page_of_its_own) {
  const std::string one_slice = "SizeC='1' SizeZ='3' SizeT='1'";
  write_pages(folder / "same.tif", 3,
              ome(one_slice, "<TiffData IFD='0' FirstZ='0' PlaneCount='2'/><TiffData IFD='1' FirstZ='2'/>"));
  EXPECT_TRUE(has_words(refusal(folder / "same.tif", {}), "the same page for several"));
  EXPECT_EQ(value_of(folder / "same.tif", {.z = "3"}), 1);
  std::string again;
  for (int i = 0; i < 100; ++i) again += "<TiffData/>";
  write_pages(folder / "again.tif", 3, ome(one_slice, again));
  EXPECT_TRUE(has_words(refusal(folder / "again.tif", {}), "over and over"));
}

TEST_F(ImagePlanes, channels_are_called_by_name_and_listed_where_none_was_chosen) {
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
  EXPECT_TRUE(has_words(refusal(file, {.channel = "dapi"}), "3 channels: 1 'Paxillin'"));
  EXPECT_TRUE(has_words(refusal(file, {.channel = "4"}), "3 channels"));
}

TEST_F(ImagePlanes, a_claim_of_millions_of_channels_is_named_in_a_line) {
  write_pages(folder / "a.ome.tif", 1, ome("SizeC='4000000' SizeZ='1' SizeT='1'", ""));
  const std::string told = refusal(folder / "a.ome.tif", {});
  EXPECT_TRUE(has_words(told, "4000000 channels: 1, 2, 3,")) << told.substr(0, 300);
  EXPECT_LT(told.size(), 500u);
}

TEST_F(ImagePlanes, frames_must_be_chosen_and_slices_be_there) {
  const fs::path file = folder / "a.tif";
  write_pages(file, 6, "ImageJ=1.53t\nimages=6\nslices=3\nframes=2\n");
  EXPECT_TRUE(has_words(refusal(file, {.prefix = "actin"}), "2 frames; set actin_time"));
  EXPECT_TRUE(has_words(refusal(file, {.time = 3}), "2 frames"));
  EXPECT_TRUE(has_words(refusal(file, {.z = "4", .time = 1}), "3 slices"));
  EXPECT_TRUE(has_words(refusal(file, {.z = "mean", .time = 1}), "3 slices"));
  EXPECT_EQ(value_of(file, {.time = 2}), 5);
}

TEST_F(ImagePlanes, samples_of_a_pixel_are_channels) {
  write_pages(folder / "a.tif", 1, "", 2);
  EXPECT_EQ(value_of(folder / "a.tif", {.channel = "2"}), 100);
  EXPECT_TRUE(has_words(refusal(folder / "a.tif", {}), "2 channels"));
}

TEST_F(ImagePlanes, contradicting_dimensions_are_an_error_but_pages_can_still_be_read) {
  int n = 0;
  for (const std::string& description :
       {std::string("ImageJ=1.53t\nimages=4\nchannels=3\n"), std::string("ImageJ=1.53t\nimages=4\nchannels=x\n"),
        ome("SizeC='2' SizeZ='x'", ""), ome("SizeC='4194304' SizeZ='4194304'", ""), ome("DimensionOrder='XYCCC'", ""),
        std::string("<OME><Image><Pixels SizeC='2'"),
        std::string("<OME><BinaryOnly MetadataFile='a.companion'/></OME>")}) {
    const fs::path file = folder / (std::to_string(n++) + ".tif");
    write_pages(file, 4, description);
    EXPECT_TRUE(has_words(refusal(file, {}), "set image_page")) << description;
    EXPECT_EQ(value_of(file, {.page = 3}), 2);
  }
}

TEST_F(ImagePlanes, more_than_4_GB_of_imagej_are_planes_after_the_only_page) {
  // as ij.io.TiffEncoder writes it: big-endian, tags first, then the planes without pages of their own
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
    EXPECT_TRUE(has_words(refusal(stack(bits, 5), {.channel = "2", .z = "3"}), "plane 6 at bytes"));
  }
}

const fs::path kSharedImages = test::source_folder().parent_path() / "shared/data";

TEST_F(ImagePlanes, real_hyperstacks_are_read_as_by_another_program) {
  if (!fs::exists(kSharedImages / "tiff")) GTEST_SKIP() << "the images of other programs are not here";
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
    double sum = 0;
    for (const float value : read_image(kSharedImages / c.file, c.choice).pixels) sum += value;
    EXPECT_EQ(sum, c.sum) << c.file << " channel " << c.choice.channel;
  }
}

TEST_F(ImagePlanes, the_distance_of_slices_is_the_files_own) {
  const fs::path file = folder / "a.tif";
  const auto step_of = [&](const std::string& description) {
    write_pages(file, 3, description);
    return read_slices(file, {}).front().z_step_um;
  };
  const std::string imagej = "ImageJ=1.53t\nimages=3\nslices=3\n";
  EXPECT_DOUBLE_EQ(step_of(imagej + "unit=micron\nspacing=0.45\n").value(), 0.45);
  EXPECT_DOUBLE_EQ(step_of(imagej + "unit=nm\nspacing=300\n").value(), 0.3);
  EXPECT_FALSE(step_of(imagej + "spacing=0.45\n")) << "without a unit it is no length";
  EXPECT_FALSE(step_of(imagej + "unit=micron\n"));
  EXPECT_FALSE(step_of(""));
  const auto ome = [](const std::string& size) {
    return "<?xml version=\"1.0\"?><OME><Image><Pixels DimensionOrder=\"XYZCT\" SizeX=\"4\" SizeY=\"3\" SizeZ=\"3\" "
           "SizeC=\"1\" SizeT=\"1\" " +
           size + "><Channel/></Pixels></Image></OME>";
  };
  EXPECT_DOUBLE_EQ(step_of(ome("PhysicalSizeZ=\"0.8\"")).value(), 0.8);
  EXPECT_DOUBLE_EQ(step_of(ome("PhysicalSizeZ=\"800\" PhysicalSizeZUnit=\"nm\"")).value(), 0.8);
  EXPECT_FALSE(step_of(ome("")));
}

TEST_F(ImagePlanes, a_stack_comes_back_as_it_was_written) {
  std::vector<Image> slices(5);
  for (std::size_t k = 0; k < slices.size(); ++k) {
    slices[k].width = 4, slices[k].height = 3, slices[k].pixel_size_um = 0.2, slices[k].z_step_um = 0.65;
    slices[k].pixels.assign(12, static_cast<float>(10 * k));
  }
  write_tiff(folder / "a.tif", slices);
  const std::vector<Image> read = read_slices(folder / "a.tif", {});
  ASSERT_EQ(read.size(), slices.size());
  for (std::size_t k = 0; k < slices.size(); ++k) {
    EXPECT_EQ(read[k].pixels, slices[k].pixels);
    EXPECT_DOUBLE_EQ(read[k].pixel_size_um.value(), 0.2);
    EXPECT_DOUBLE_EQ(read[k].z_step_um.value(), 0.65);
  }
}

}  // namespace
}  // namespace mbtfm::images
