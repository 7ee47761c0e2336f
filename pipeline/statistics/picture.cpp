#include "pipeline/statistics/picture.h"

#include <cairo/cairo-pdf.h>
#include <cairo/cairo.h>
#include <librsvg/rsvg.h>
#include <png.h>
#include <zlib.h>

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
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

/// The chunk of a PNG that says how large its pixels are. Source: PNG specification, 11.3.5.3.
std::string size_chunk(double dots_per_inch) {
  const std::string per_metre = big_endian(static_cast<std::uint32_t>(std::lround(1000 * dots_per_inch / kInch_mm)));
  const std::string chunk = "pHYs" + per_metre + per_metre + char(1);
  const auto sum = crc32(0, reinterpret_cast<const Bytef*>(chunk.data()), static_cast<uInt>(chunk.size()));
  return big_endian(static_cast<std::uint32_t>(chunk.size() - 4)) + chunk + big_endian(static_cast<std::uint32_t>(sum));
}

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;

void expect_success(cairo_status_t status, const Path& file) {
  if (status != CAIRO_STATUS_SUCCESS)
    throw OutputError("cannot write " + file.string() + ": " + cairo_status_to_string(status));
}

/// Red, green and blue of each pixel, in the place of the picture: three bytes where there were four.
const unsigned char* packed(cairo_surface_t* picture) {
  cairo_surface_flush(picture);
  unsigned char* const bytes = cairo_image_surface_get_data(picture);
  const auto n_pixels = static_cast<std::size_t>(cairo_image_surface_get_height(picture)) *
                        static_cast<std::size_t>(cairo_image_surface_get_width(picture));
  MBTFM_ASSERT(cairo_image_surface_get_stride(picture) == 4 * cairo_image_surface_get_width(picture));
  for (std::size_t i = 0; i < n_pixels; ++i) {
    std::uint32_t pixel;
    std::memcpy(&pixel, bytes + 4 * i, 4);
    for (const int k : {0, 1, 2})
      bytes[3 * i + static_cast<std::size_t>(k)] = static_cast<unsigned char>(pixel >> (16 - 8 * k));
  }
  return bytes;
}

/// A chart has few colours and long runs of them: without filters it is small by little work. Cairo's own writer tries
/// all filters on every row, which took most of the time of `mbtfm stats`.
std::string compressed(cairo_surface_t* picture, const Path& file) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = static_cast<png_uint_32>(cairo_image_surface_get_width(picture));
  image.height = static_cast<png_uint_32>(cairo_image_surface_get_height(picture));
  image.format = PNG_FORMAT_RGB;
  image.flags = PNG_IMAGE_FLAG_FAST;
  char* bytes = nullptr;
  std::size_t n_bytes = 0;
  std::FILE* const memory = open_memstream(&bytes, &n_bytes);
  const bool is_written = memory && png_image_write_to_stdio(&image, memory, 0, packed(picture), 0, nullptr);
  if (memory) std::fclose(memory);
  const std::unique_ptr<char, decltype(&std::free)> owner(bytes, std::free);
  if (!is_written) throw OutputError("cannot write " + file.string() + ": " + image.message);
  return {bytes, n_bytes};
}

}  // namespace

void write_png(const Path& file, const std::string& svg, double width_mm, double dots_per_inch) {
  const Drawing drawing(file, svg);
  const double width = std::round(width_mm / kInch_mm * dots_per_inch);
  const Surface picture(cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(width),
                                                   static_cast<int>(std::lround(width * drawing.height_over_width()))),
                        cairo_surface_destroy);
  drawing.render(picture.get(), width);
  std::string png = compressed(picture.get(), file);
  constexpr std::size_t kHeader = 8 + 25;  // the signature and the first chunk, IHDR: pHYs stands before the pixels
  png.insert(kHeader, size_chunk(dots_per_inch));
  files::write_text(file, png);
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
