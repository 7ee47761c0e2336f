#include "pipeline/statistics/picture.h"

#include <cairo/cairo-pdf.h>
#include <cairo/cairo.h>
#include <librsvg/rsvg.h>
#include <png.h>
#include <zlib.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <memory>

#include "pipeline/contract/errors.h"
#include "pipeline/files/text.h"

namespace mbtfm::statistics {

namespace {

constexpr double kInch_mm = 25.4, kPoints_per_inch = 72;

class Drawing {
 public:
  Drawing(const Path& file, const std::string& svg) : file_(file.string()), handle_(open(file_, svg), g_object_unref) {
    MBTFM_ASSERT(rsvg_handle_get_intrinsic_size_in_pixels(handle_.get(), &width_, &height_));
  }
  double height_over_width() const { return height_ / width_; }
  /// Fills the surface. @param width  in the surface's units
  void render(cairo_surface_t* surface, double width) const {
    const std::unique_ptr<cairo_t, decltype(&cairo_destroy)> context(cairo_create(surface), cairo_destroy);
    const RsvgRectangle whole{0, 0, width, width * height_over_width()};
    GError* error = nullptr;
    if (!rsvg_handle_render_document(handle_.get(), context.get(), &whole, &error))
      throw InternalError(file_ + ": librsvg: " + error->message);
  }

 private:
  static RsvgHandle* open(const std::string& file, const std::string& svg) {
    GError* error = nullptr;
    RsvgHandle* handle = rsvg_handle_new_from_data(reinterpret_cast<const guint8*>(svg.data()), svg.size(), &error);
    if (handle == nullptr) throw InternalError(file + ": librsvg: " + error->message);
    return handle;
  }
  std::string file_;
  std::unique_ptr<RsvgHandle, decltype(&g_object_unref)> handle_;
  double width_ = 0, height_ = 0;
};

cairo_status_t append(void* to, const unsigned char* bytes, unsigned int n) {
  static_cast<std::string*>(to)->append(reinterpret_cast<const char*>(bytes), n);
  return CAIRO_STATUS_SUCCESS;
}

std::string big_endian(std::uint32_t number) {
  std::string bytes;
  for (int shift = 24; shift >= 0; shift -= 8) bytes += static_cast<char>(number >> shift);
  return bytes;
}

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;

/// Of a PNG. @param content  with its name of four letters before it. Source: PNG specification, 5.3.
std::string chunk(const std::string& content) {
  const auto sum = crc32(0, reinterpret_cast<const Bytef*>(content.data()), static_cast<uInt>(content.size()));
  return big_endian(static_cast<std::uint32_t>(content.size() - 4)) + content +
         big_endian(static_cast<std::uint32_t>(sum));
}

/// How large its pixels are. Source: 11.3.5.3.
std::string size_chunk(double dots_per_inch) {
  const std::string per_metre = big_endian(static_cast<std::uint32_t>(std::lround(1000 * dots_per_inch / kInch_mm)));
  return chunk("pHYs" + per_metre + per_metre + char(1));
}

void expect_success(cairo_status_t status, const Path& file) {
  if (status != CAIRO_STATUS_SUCCESS)
    throw OutputError("cannot write " + file.string() + ": " + cairo_status_to_string(status));
}

struct Pixels {
  std::uint32_t width = 0, height = 0;
  std::vector<std::uint32_t> rgb = {};  ///< 0x00RRGGBB
};

Pixels pixels_of(const Drawing& drawing, double width) {
  Pixels pixels{.width = static_cast<std::uint32_t>(width),
                .height = static_cast<std::uint32_t>(std::lround(width * drawing.height_over_width()))};
  const Surface picture(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(pixels.width), static_cast<int>(pixels.height)),
      cairo_surface_destroy);
  drawing.render(picture.get(), width);
  cairo_surface_flush(picture.get());
  MBTFM_ASSERT(cairo_image_surface_get_stride(picture.get()) == 4 * static_cast<int>(pixels.width));
  pixels.rgb.resize(std::size_t{pixels.width} * pixels.height);
  std::memcpy(pixels.rgb.data(), cairo_image_surface_get_data(picture.get()), 4 * pixels.rgb.size());
  for (std::uint32_t& pixel : pixels.rgb) pixel &= 0xFFFFFF;
  return pixels;
}

/// Red, green, blue of each pixel; with a fourth byte, which says whether it differs, if there is one before it.
std::vector<unsigned char> bytes_of(const Pixels& pixels, const Pixels* before) {
  std::vector<unsigned char> bytes((before ? 4 : 3) * pixels.rgb.size());
  unsigned char* next = bytes.data();
  for (std::size_t i = 0; i < pixels.rgb.size(); ++i) {
    const bool is_same = before && before->rgb[i] == pixels.rgb[i];
    for (const int shift : {16, 8, 0}) *next++ = static_cast<unsigned char>(is_same ? 0 : pixels.rgb[i] >> shift);
    if (before) *next++ = is_same ? 0 : 255;
  }
  return bytes;
}

/// A chart has few colours and long runs of them: without filters it is small by little work. Cairo's own writer tries
/// all filters on every row, which took most of the time of `mbtfm stats`.
std::string compressed(const Pixels& pixels, const Pixels* before, const Path& file) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = pixels.width;
  image.height = pixels.height;
  image.format = before ? PNG_FORMAT_RGBA : PNG_FORMAT_RGB;
  image.flags = PNG_IMAGE_FLAG_FAST;
  png_alloc_size_t n_bytes = PNG_IMAGE_PNG_SIZE_MAX(image);
  std::string png(n_bytes, '\0');
  if (!png_image_write_to_memory(&image, png.data(), &n_bytes, 0, bytes_of(pixels, before).data(), 0, nullptr))
    throw OutputError("cannot write " + file.string() + ": " + image.message);
  png.resize(n_bytes);
  return png;
}

constexpr std::size_t kHeader = 8 + 25;  // the signature and the first chunk, IHDR

/// What the chunks IDAT of a PNG hold.
std::vector<std::string> data_of(const std::string& png) {
  std::vector<std::string> data;
  for (std::size_t at = kHeader; at + 12 <= png.size();) {
    std::size_t size = 0;
    for (int k = 0; k < 4; ++k) size = 256 * size + static_cast<unsigned char>(png[at + static_cast<std::size_t>(k)]);
    if (png.compare(at + 4, 4, "IDAT") == 0) data.push_back(png.substr(at + 8, size));
    at += size + 12;
  }
  return data;
}

}  // namespace

void write_png(const Path& file, const std::string& svg, double width_mm, double dots_per_inch) {
  const Pixels pixels = pixels_of(Drawing(file, svg), std::round(width_mm / kInch_mm * dots_per_inch));
  std::string png = compressed(pixels, nullptr, file);
  png.insert(kHeader, size_chunk(dots_per_inch));  // before the pixels
  files::write_text(file, png);
}

/// Source: https://wiki.mozilla.org/APNG_Specification
void write_animation(const Path& file, const std::vector<std::string>& drawings) {
  constexpr double kWidth_px = 920;
  const std::string delay = {0, 45, 0, 100};  // s: a numerator and a denominator
  std::string png;
  std::uint32_t n_sequence = 0;
  Pixels before;
  for (const std::string& svg : drawings) {
    const Pixels now = pixels_of(Drawing(file, svg), kWidth_px);
    const bool is_first = png.empty();
    if (is_first)
      before = {.width = now.width, .height = now.height, .rgb = std::vector<std::uint32_t>(now.rgb.size(), ~0u)};
    MBTFM_ASSERT(now.rgb.size() == before.rgb.size());
    const std::string frame = compressed(now, &before, file);
    if (is_first)
      png = frame.substr(0, kHeader) +
            chunk("acTL" + big_endian(static_cast<std::uint32_t>(drawings.size())) + big_endian(0));
    const std::string whole = big_endian(now.width) + big_endian(now.height) + big_endian(0) + big_endian(0);
    const std::string kept_and_over = {
        0, static_cast<char>(is_first ? 0 : 1)};  // the frame before stays, changes are laid over it
    png += chunk("fcTL" + big_endian(n_sequence++) + whole + delay + kept_and_over);
    for (const std::string& data : data_of(frame))
      png += is_first ? chunk("IDAT" + data) : chunk("fdAT" + big_endian(n_sequence++) + data);
    before = now;
  }
  files::write_text(file, png + chunk("IEND"));
}

void write_pdf(const Path& file, const std::string& svg, double width_mm) {
  const Drawing drawing(file, svg);
  const double width = width_mm / kInch_mm * kPoints_per_inch;
  std::string pdf;
  {
    const Surface page(cairo_pdf_surface_create_for_stream(append, &pdf, width, width * drawing.height_over_width()),
                       cairo_surface_destroy);
    cairo_pdf_surface_set_metadata(page.get(), CAIRO_PDF_METADATA_CREATE_DATE,
                                   "2000-01-01T00:00:00");  // the same bytes
    drawing.render(page.get(), width);
    cairo_surface_finish(page.get());
    expect_success(cairo_surface_status(page.get()), file);
  }
  files::write_text(file, pdf);
}

}  // namespace mbtfm::statistics
