#include "segment/images/tiff_handle.h"

#include <algorithm>
#include <cmath>
#include <cstdarg>
#include <cstdio>
#include <cstring>
#include <limits>
#include <string_view>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "segment/images/image.h"
#include "segment/images/image_file.h"

namespace mbtfm::images {
namespace {

/// libtiff complains of each tag that is not as it expects; those of other programs (private ones), and names and
/// dates, are not needed for the pixels.
bool is_of_a_needed_tag(const std::string& message) {
  constexpr std::string_view kNeeded =
      " ImageWidth ImageLength BitsPerSample Compression PhotometricInterpretation ImageDescription StripOffsets "
      "SamplesPerPixel RowsPerStrip StripByteCounts XResolution YResolution PlanarConfiguration ResolutionUnit "
      "Predictor ColorMap TileWidth TileLength TileOffsets TileByteCounts ExtraSamples SampleFormat JPEGTables "
      "FillOrder YCbCrSubsampling ReferenceBlackWhite SubFileType ";
  const std::size_t begin = message.find('"'), end = message.find('"', begin + 1);
  return begin == std::string::npos || end == std::string::npos ||
         kNeeded.find(" " + message.substr(begin + 1, end - begin - 1) + " ") != kNeeded.npos;
}

std::string text_of(const char* format, va_list arguments) {
  char text[512];
  std::vsnprintf(text, sizeof text, format, arguments);
  return text;
}

/// 1: handled, nothing goes to the terminal.
int keep(void* messages, const std::string& text) {
  auto& first = static_cast<Messages*>(messages)->first_error;
  if (first.empty() && is_of_a_needed_tag(text)) first = text;
  return 1;
}

int keep_error(TIFF*, void* messages, const char*, const char* format, va_list arguments) {
  return keep(messages, text_of(format, arguments));
}

/// Warnings are of no concern, but for the one that a file ends within its tags: the calibration may be lost with them.
int keep_warning_of_early_end(TIFF*, void* messages, const char*, const char* format, va_list arguments) {
  const std::string text = text_of(format, arguments);
  return text.find("IO error during reading") == text.npos ? 1 : keep(messages, text);
}

[[noreturn]] void refuse(const std::filesystem::path& file, const std::string& expected, const std::string& found,
                         const std::string& hint = {}) {
  throw InputError(file.string(), expected, found, hint);
}

void require_known_samples(const Layout& l, const std::filesystem::path& file) {
  const std::string found = std::to_string(l.bits) + " bits";
  if (l.format == SAMPLEFORMAT_IEEEFP) {
    if (l.bits != 16 && l.bits != 32 && l.bits != 64)
      refuse(file, "floating-point samples of 16, 32 or 64 bits", found);
  } else if (l.format == SAMPLEFORMAT_INT) {
    if (l.bits != 8 && l.bits != 16 && l.bits != 32 && l.bits != 64)
      refuse(file, "signed samples of 8, 16, 32 or 64 bits", found);
  } else if (l.format == SAMPLEFORMAT_UINT) {
    if ((l.bits < 1 || l.bits > 32) && l.bits != 64) refuse(file, "samples of 1 to 32 or of 64 bits", found);
  } else {
    refuse(file, "real samples", "complex ones");
  }
}

/// Further samples are channels of their own where they are not transparency.
void count_channels(Layout& l, TIFF* tiff, const std::filesystem::path& file) {
  std::uint16_t n_extra = 0;
  std::uint16_t* kinds = nullptr;
  TIFFGetFieldDefaulted(tiff, TIFFTAG_EXTRASAMPLES, &n_extra, &kinds);
  const bool is_alpha = l.samples == l.colours + n_extra &&
                        std::all_of(kinds, kinds + n_extra, [](auto kind) { return kind != EXTRASAMPLE_UNSPECIFIED; });
  if (is_alpha) return;
  if (l.is_rgb) {
    refuse(file, "three colour channels", std::to_string(l.samples) + " channels",
           "save each channel as a page of its own");
  }
  l.n_channels = l.samples;
}

void set_colours(Layout& l, TIFF* tiff, const std::filesystem::path& file) {
  const auto compression = tag_of<std::uint16_t>(tiff, TIFFTAG_COMPRESSION, COMPRESSION_NONE);
  if (!TIFFIsCODECConfigured(compression)) {
    refuse(file, "a compression that libtiff knows here", "compression " + std::to_string(compression),
           "save the image uncompressed or with deflate");
  }
  std::uint16_t photometric = PHOTOMETRIC_MINISBLACK;
  TIFFGetField(tiff, TIFFTAG_PHOTOMETRIC, &photometric);
  if (photometric == PHOTOMETRIC_YCBCR && compression == COMPRESSION_JPEG && !l.is_planar) {
    TIFFSetField(tiff, TIFFTAG_JPEGCOLORMODE, JPEGCOLORMODE_RGB);  // libjpeg converts
    photometric = PHOTOMETRIC_RGB;
  }
  const bool is_grey = photometric == PHOTOMETRIC_MINISBLACK || photometric == PHOTOMETRIC_MINISWHITE ||
                       photometric == PHOTOMETRIC_PALETTE;
  if (!is_grey && photometric != PHOTOMETRIC_RGB) {
    refuse(file, "a grey or RGB image", "photometric interpretation " + std::to_string(photometric),
           "convert it to grey: the original of the microscope is best");
  }
  l.is_rgb = !is_grey;
  l.colours = l.n_channels = l.is_rgb ? 3 : 1;
  l.is_inverted = photometric == PHOTOMETRIC_MINISWHITE;
  if (l.is_inverted && l.format != SAMPLEFORMAT_UINT) refuse(file, "0 to be black", "0 to be white in signed samples");
  if (l.samples > l.colours) count_channels(l, tiff, file);
  if (l.samples < l.colours) refuse(file, "three colour channels", std::to_string(l.samples) + " channels");
}

template <class T>
void unpack_as(const unsigned char* bytes, std::vector<float>& row) {
  for (std::size_t i = 0; i < row.size(); ++i) {
    T value;
    std::memcpy(&value, bytes + i * sizeof(T), sizeof(T));
    row[i] = static_cast<float>(value);
  }
}

/// IEEE 754 binary16: a sign, five bits of exponent, ten of fraction.
void unpack_halves(const unsigned char* bytes, std::vector<float>& row) {
  constexpr int kBias = 15, kFractionBits = 10, kInfinite = 31;
  for (std::size_t i = 0; i < row.size(); ++i) {
    std::uint16_t half;
    std::memcpy(&half, bytes + i * sizeof half, sizeof half);
    const int exponent = half >> kFractionBits & kInfinite, fraction = half & ((1 << kFractionBits) - 1);
    float value = exponent == 0 ? std::ldexp(static_cast<float>(fraction), 1 - kBias - kFractionBits)
                                : std::ldexp(static_cast<float>(fraction + (1 << kFractionBits)),
                                             exponent - kBias - kFractionBits);
    if (exponent == kInfinite)
      value = fraction == 0 ? std::numeric_limits<float>::infinity() : std::numeric_limits<float>::quiet_NaN();
    row[i] = half >> 15 ? -value : value;
  }
}

void unpack_bits(const unsigned char* bytes, int n_bits, std::vector<float>& row) {
  std::size_t at = 0;
  for (float& value : row) {
    std::uint32_t sample = 0;
    for (int bit = 0; bit < n_bits; ++bit, ++at) sample = sample << 1 | (bytes[at / 8] >> (7 - at % 8) & 1u);
    value = static_cast<float>(sample);
  }
}

}  // namespace

TiffHandle open_tiff(const std::filesystem::path& file, const char* mode, Messages& messages) {
  const std::unique_ptr<TIFFOpenOptions, decltype(&TIFFOpenOptionsFree)> options(TIFFOpenOptionsAlloc(),
                                                                                 &TIFFOpenOptionsFree);
  TIFFOpenOptionsSetErrorHandlerExtR(options.get(), keep_error, &messages);
  TIFFOpenOptionsSetWarningHandlerExtR(options.get(), keep_warning_of_early_end, &messages);
  return TiffHandle(TIFFOpenExt(file.c_str(), mode, options.get()));
}

namespace {

/// What ImageJ says of an image, or of the slices of a stack.
std::string description_of(const Image& image, std::size_t n_slices) {
  std::string text = "ImageJ=1.53t\n";
  const std::string n = std::to_string(n_slices);
  if (n_slices > 1) text += "images=" + n + "\nslices=" + n + "\n";
  if (image.pixel_size_um) text += "unit=micron\n";
  if (n_slices > 1 && image.z_step_um) text += "spacing=" + shortest(*image.z_step_um) + "\n";
  return text;
}

void set_tags(TIFF* tiff, const Image& image, const std::string& description) {
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, static_cast<std::uint32_t>(image.width));
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, static_cast<std::uint32_t>(image.height));
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
  TIFFSetField(tiff, TIFFTAG_PREDICTOR, PREDICTOR_HORIZONTAL);
  TIFFSetField(tiff, TIFFTAG_ROWSPERSTRIP, static_cast<std::uint32_t>(std::min(image.height, 64)));
  TIFFSetField(tiff, TIFFTAG_IMAGEDESCRIPTION, description.c_str());
  if (!image.pixel_size_um) return;
  TIFFSetField(tiff, TIFFTAG_XRESOLUTION, 1 / *image.pixel_size_um);
  TIFFSetField(tiff, TIFFTAG_YRESOLUTION, 1 / *image.pixel_size_um);
  TIFFSetField(tiff, TIFFTAG_RESOLUTIONUNIT, RESUNIT_NONE);
}

}  // namespace

void write_tiff(const std::filesystem::path& file, const Image& image) { write_tiff(file, std::vector{image}); }

void write_tiff(const std::filesystem::path& file, const std::vector<Image>& slices) {
  MBTFM_ASSERT(!slices.empty() && slices.front().width > 0 && slices.front().height > 0);
  Messages messages;
  const auto require = [&](bool is_done) {
    if (!is_done)
      throw OutputError(file.string() + ": cannot be written" +
                        (messages.first_error.empty() ? "" : ": " + messages.first_error));
  };
  TiffHandle tiff = open_tiff(file, "w", messages);
  require(tiff != nullptr);
  const std::string description = description_of(slices.front(), slices.size());
  for (const Image& image : slices) {
    set_tags(tiff.get(), image, description);
    std::vector<std::uint16_t> row(static_cast<std::size_t>(image.width));
    for (int j = 0; j < image.height; ++j) {
      for (int i = 0; i < image.width; ++i)
        row[i] = static_cast<std::uint16_t>(std::clamp(std::round(image.at(i, j)), 0.0f, 65535.0f));
      require(TIFFWriteScanline(tiff.get(), row.data(), static_cast<std::uint32_t>(j), 0) == 1);
    }
    require(TIFFWriteDirectory(tiff.get()) == 1);
  }
  tiff.reset();
  require(messages.first_error.empty());
}

Layout layout_of(TIFF* tiff, const std::filesystem::path& file) {
  Layout result;
  TIFFGetField(tiff, TIFFTAG_IMAGEWIDTH, &result.width);
  TIFFGetField(tiff, TIFFTAG_IMAGELENGTH, &result.height);
  require_plausible_size(file, result.width, result.height);
  result.bits = tag_of<std::uint16_t>(tiff, TIFFTAG_BITSPERSAMPLE, 1);
  result.format = tag_of<std::uint16_t>(tiff, TIFFTAG_SAMPLEFORMAT, SAMPLEFORMAT_UINT);
  if (result.format == SAMPLEFORMAT_VOID) result.format = SAMPLEFORMAT_UINT;
  result.samples = tag_of<std::uint16_t>(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
  result.is_planar = tag_of<std::uint16_t>(tiff, TIFFTAG_PLANARCONFIG, PLANARCONFIG_CONTIG) == PLANARCONFIG_SEPARATE;
  require_known_samples(result, file);
  set_colours(result, tiff, file);
  return result;
}

void unpack(const unsigned char* bytes, const Layout& layout, std::vector<float>& row) {
  const bool is_signed = layout.format == SAMPLEFORMAT_INT, is_float = layout.format == SAMPLEFORMAT_IEEEFP;
  switch (layout.bits) {
    case 8:
      return is_signed ? unpack_as<std::int8_t>(bytes, row) : unpack_as<std::uint8_t>(bytes, row);
    case 16:
      if (is_float) return unpack_halves(bytes, row);
      return is_signed ? unpack_as<std::int16_t>(bytes, row) : unpack_as<std::uint16_t>(bytes, row);
    case 32:
      if (is_float) return unpack_as<float>(bytes, row);
      return is_signed ? unpack_as<std::int32_t>(bytes, row) : unpack_as<std::uint32_t>(bytes, row);
    case 64:
      if (is_float) return unpack_as<double>(bytes, row);
      return is_signed ? unpack_as<std::int64_t>(bytes, row) : unpack_as<std::uint64_t>(bytes, row);
    case 24:
      for (std::size_t i = 0; i < row.size(); ++i, bytes += 3)
        row[i] = static_cast<float>(bytes[0] | bytes[1] << 8 | bytes[2] << 16);
      return;
    default:
      unpack_bits(bytes, layout.bits, row);
  }
}

}  // namespace mbtfm::images
