/// TIFF, PNG and JPEG images.
#include <tiffio.h>

#include "segment/images/image.h"
#include "segment/images/png.h"
#include "tests/fuzz/target.h"
#include "tests/support/folders.h"

namespace mbtfm::fuzz::image_readers {
namespace {

struct Layout {
  int bits = 16, format = SAMPLEFORMAT_UINT, samples = 1, compression = COMPRESSION_NONE, pages = 1;
  bool is_tiled = false, is_planar = false;
  std::string description = {};
};

std::string tiff(const Layout& layout) {
  const std::string file = (folder() / "whole.tif").string();
  TIFF* tiff = TIFFOpen(file.c_str(), "w");
  constexpr int kSide = 32;
  for (int page = 0; page < layout.pages; ++page) {
    TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, kSide);
    TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, kSide);
    TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, layout.bits);
    TIFFSetField(tiff, TIFFTAG_SAMPLEFORMAT, layout.format);
    TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, layout.samples);
    TIFFSetField(tiff, TIFFTAG_PLANARCONFIG, layout.is_planar ? PLANARCONFIG_SEPARATE : PLANARCONFIG_CONTIG);
    TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, layout.samples == 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK);
    TIFFSetField(tiff, TIFFTAG_COMPRESSION, layout.compression);
    if (page == 0 && !layout.description.empty())
      TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, layout.description.c_str());
    layout.is_tiled ? TIFFSetField(tiff, TIFFTAG_TILEWIDTH, 16) : TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, 8);
    if (layout.is_tiled) TIFFSetField(tiff, TIFFTAG_TILELENGTH, 16);
    const std::uint32_t n = layout.is_tiled ? TIFFNumberOfTiles(tiff) : TIFFNumberOfStrips(tiff);
    std::string block(static_cast<std::size_t>(layout.is_tiled ? TIFFTileSize(tiff) : TIFFStripSize(tiff)), '\0');
    for (std::uint32_t k = 0; k < n; ++k) {
      for (std::size_t i = 0; i < block.size(); ++i) block[i] = static_cast<char>(i * i / 7 % 31 + k + page);
      layout.is_tiled ? TIFFWriteEncodedTile(tiff, k, block.data(), static_cast<tmsize_t>(block.size()))
                      : TIFFWriteEncodedStrip(tiff, k, block.data(), static_cast<tmsize_t>(block.size()));
    }
    TIFFWriteDirectory(tiff);
  }
  TIFFClose(tiff);
  return bytes_of(file);
}

std::vector<std::string> samples() {
  put("whole.png", "");
  images::write_png(folder() / "whole.png", {.width = 40, .height = 30, .rgb = std::vector<std::uint8_t>(3600, 17)});
  put("whole.jpg", "");
  images::write_jpeg(folder() / "whole.jpg", {.width = 40, .height = 30, .rgb = std::vector<std::uint8_t>(3600, 17)});
  std::vector<std::string> files = {bytes_of(folder() / "whole.png"), bytes_of(folder() / "whole.jpg")};
  for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_PACKBITS, COMPRESSION_ADOBE_DEFLATE,
                                COMPRESSION_JPEG, COMPRESSION_ZSTD, COMPRESSION_LZMA, COMPRESSION_WEBP}) {
    if (!TIFFIsCODECConfigured(static_cast<std::uint16_t>(compression))) continue;
    const bool is_of_bytes = compression == COMPRESSION_JPEG || compression == COMPRESSION_WEBP;
    files.push_back(tiff({.bits = is_of_bytes ? 8 : 16, .samples = is_of_bytes ? 3 : 1, .compression = compression}));
    files.push_back(tiff({.bits = 8, .samples = is_of_bytes ? 3 : 1, .compression = compression, .is_tiled = true}));
  }
  files.push_back(tiff({.bits = 32, .format = SAMPLEFORMAT_IEEEFP}));
  files.push_back(tiff({.bits = 12}));
  files.push_back(tiff({.bits = 1}));
  files.push_back(tiff({.bits = 8, .samples = 3, .is_planar = true}));
  files.push_back(tiff({.samples = 2}));
  files.push_back(
      tiff({.bits = 8, .pages = 6, .description = "ImageJ=1.53t\nimages=6\nchannels=2\nslices=3\nunit=micron\n"}));
  files.push_back(tiff({.bits = 8, .description = "ImageJ=1.53t\nimages=2\nslices=2\n"}));
  files.push_back(tiff(
      {.bits = 8,
       .pages = 6,
       .description = "<OME UUID='urn:uuid:a'><Image><Pixels DimensionOrder='XYZCT' SizeC='2' SizeZ='3' SizeT='1' "
                      "PhysicalSizeX='0.1'><Channel Name='a'/><Channel Name='b'/><TiffData IFD='0' FirstC='1' "
                      "PlaneCount='3'><UUID FileName='a.tif'>urn:uuid:a</UUID></TiffData></Pixels></Image></OME>"}));
  const auto shared = test::source_folder().parent_path() / "shared/data/tiff";  // of other programs, if at hand
  if (std::filesystem::exists(shared))
    for (const auto& entry : std::filesystem::recursive_directory_iterator(shared))
      if (entry.is_regular_file() && entry.path().extension() != ".csv") files.push_back(bytes_of(entry.path()));
  return files;
}

void read(std::string_view bytes) {
  const auto file = fuzz::put("input", bytes);
  fuzz::answer([&] { images::read_image(file); });
  fuzz::answer([&] { images::read_image(file, {.channel = "2", .z = "1", .time = 1}); });
  fuzz::answer([&] { images::read_image(file, 1); });
  fuzz::answer([&] { images::read_slices(file, {.may_lack_pixels = true}); });
}

const bool is_added = add({"image", 5000, samples, read});

}  // namespace
}  // namespace mbtfm::fuzz::image_readers
