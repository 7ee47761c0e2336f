#include "segment/images/png.h"

#include <png.h>

#include <algorithm>
#include <cstdio>

#include "pipeline/contract/errors.h"
#include "pipeline/files/text.h"
#include "segment/images/image_file.h"

namespace mbtfm::images {
namespace {

/// What libpng complains of, in a fixed buffer: libpng leaves by longjmp, which runs no destructor.
struct Message {
  char text[256] = "";
};

void keep_error(png_structp png, png_const_charp text) {
  auto* message = static_cast<Message*>(png_get_error_ptr(png));
  std::snprintf(message->text, sizeof message->text, "%s", text);
  png_longjmp(png, 1);
}

void ignore_warning(png_structp, png_const_charp) {}

/// libpng's state; everything that a longjmp must not skip lives here, outside of the functions that jump.
struct PngReading {
  Message message;
  png_structp png = png_create_read_struct(PNG_LIBPNG_VER_STRING, &message, keep_error, ignore_warning);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  png_uint_32 width = 0, height = 0;
  int bits = 0, channels = 0;
  std::vector<unsigned char> bytes;
  std::vector<unsigned char*> rows;
  PngReading() = default;
  PngReading(const PngReading&) = delete;
  ~PngReading() { png_destroy_read_struct(&png, &info, nullptr); }
};

bool is_grey(const png_color& colour) { return colour.red == colour.green && colour.green == colour.blue; }

/// Colours that grow brighter from one to the next, as a lookup table of ImageJ's, or are a label each: the index is
/// the value. Of other colours, as those a picture was reduced to, and of greys, the colours are.
bool is_index_the_value(const png_color* palette, int n, PixelsAre pixels) {
  if (std::all_of(palette, palette + n, is_grey)) return false;
  if (pixels == PixelsAre::labels) return true;
  const auto brightness = [](const png_color& c) { return int{c.red} + c.green + c.blue; };
  return std::is_sorted(palette, palette + n,
                        [&](const png_color& a, const png_color& b) { return brightness(a) < brightness(b); });
}

bool read_png_header(PngReading& r, std::FILE* stream, PixelsAre pixels) {
  if (setjmp(png_jmpbuf(r.png))) return false;
  png_init_io(r.png, stream);
  png_read_info(r.png, r.info);
  r.width = png_get_image_width(r.png, r.info);
  r.height = png_get_image_height(r.png, r.info);
  r.bits = png_get_bit_depth(r.png, r.info);
  png_colorp palette = nullptr;
  int n_colours = 0;
  if (png_get_color_type(r.png, r.info) == PNG_COLOR_TYPE_PALETTE &&
      (png_get_PLTE(r.png, r.info, &palette, &n_colours) == 0 || !is_index_the_value(palette, n_colours, pixels))) {
    png_set_palette_to_rgb(r.png);
    r.bits = 8;
  }
  png_set_packing(r.png);  // 1, 2 and 4 bits: one sample a byte, not scaled
  png_set_strip_alpha(r.png);
  png_set_interlace_handling(r.png);
  png_read_update_info(r.png, r.info);
  r.channels = png_get_channels(r.png, r.info);
  return true;
}

bool read_png_rows(PngReading& r) {
  if (setjmp(png_jmpbuf(r.png))) return false;
  png_read_image(r.png, r.rows.data());
  png_read_end(r.png, nullptr);
  return true;
}

void append(png_structp png, png_bytep data, png_size_t size) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(data), size);
}

bool write_all(png_structp png, png_infop info, std::string& bytes, const Picture& picture) {
  if (setjmp(png_jmpbuf(png))) return false;
  png_set_write_fn(png, &bytes, append, nullptr);
  png_set_IHDR(png, info, static_cast<png_uint_32>(picture.width), static_cast<png_uint_32>(picture.height), 8,
               PNG_COLOR_TYPE_RGB, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT, PNG_FILTER_TYPE_DEFAULT);
  // a seventh of the default's time for 5 % more bytes, on an overlay
  png_set_compression_level(png, 2);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_write_info(png, info);
  for (int j = 0; j < picture.height; ++j)
    png_write_row(png, picture.rgb.data() + static_cast<std::size_t>(j) * picture.width * 3);
  png_write_end(png, info);
  return true;
}

}  // namespace

Image read_png(const std::filesystem::path& file, const PlaneChoice& choice) {
  const FileHandle stream(std::fopen(file.c_str(), "rb"));
  PngReading r;
  if (!stream || !r.info) throw InputError(file.string(), "a readable PNG image", "a file that cannot be opened");
  const auto fail = [&] {
    throw InputError(file.string(), "a whole PNG image", r.message.text[0] ? r.message.text : "damaged data",
                     "the file may be truncated or damaged: copy or export it again");
  };
  if (!read_png_header(r, stream.get(), choice.pixels)) fail();
  require_plausible_size(file, r.width, r.height);
  const std::size_t row_bytes = static_cast<std::size_t>(r.width) * r.channels * (r.bits == 16 ? 2 : 1);
  require_plausible_bytes(file, row_bytes * r.height);
  require_packed_bytes(file, row_bytes * r.height, kMostByDeflate);
  r.bytes.resize(row_bytes * r.height);
  for (std::size_t j = 0; j < r.height; ++j) r.rows.push_back(r.bytes.data() + j * row_bytes);
  const Samples samples = chosen_samples(r.channels >= 3, choice, file);
  if (!read_png_rows(r)) fail();
  return image_of(r.bytes, r.width, r.height, {r.channels, r.bits}, samples);
}

std::string png_of(const Picture& picture) {
  MBTFM_ASSERT(picture.width > 0 && picture.height > 0 &&
               picture.rgb.size() == 3 * static_cast<std::size_t>(picture.width) * picture.height);
  Message message;
  png_structp png = png_create_write_struct(PNG_LIBPNG_VER_STRING, &message, keep_error, ignore_warning);
  png_infop info = png ? png_create_info_struct(png) : nullptr;
  std::string bytes;
  const bool is_written = info && write_all(png, info, bytes, picture);
  png_destroy_write_struct(&png, &info);
  if (!is_written) throw OutputError(std::string("a PNG picture cannot be made: ") + message.text);
  return bytes;
}

void write_png(const std::filesystem::path& file, const Picture& picture) { files::write_text(file, png_of(picture)); }

}  // namespace mbtfm::images
