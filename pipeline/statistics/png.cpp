#include "pipeline/statistics/png.h"

#include <cairo/cairo.h>
#include <librsvg/rsvg.h>

#include <cmath>
#include <memory>

#include "pipeline/contract/errors.h"

namespace mbtfm::statistics {

void write_png(const Path& file, const std::string& svg, double scale) {
  GError* error = nullptr;
  const std::unique_ptr<RsvgHandle, decltype(&g_object_unref)> drawing(
      rsvg_handle_new_from_data(reinterpret_cast<const guint8*>(svg.data()), svg.size(), &error), g_object_unref);
  if (drawing == nullptr) throw InternalError(file.string() + ": librsvg: " + error->message);
  double width = 0, height = 0;
  MBTFM_ASSERT(rsvg_handle_get_intrinsic_size_in_pixels(drawing.get(), &width, &height));
  const std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)> picture(
      cairo_image_surface_create(CAIRO_FORMAT_RGB24, static_cast<int>(std::lround(scale * width)),
                                 static_cast<int>(std::lround(scale * height))),
      cairo_surface_destroy);
  const std::unique_ptr<cairo_t, decltype(&cairo_destroy)> context(cairo_create(picture.get()), cairo_destroy);
  const RsvgRectangle whole{0, 0, scale * width, scale * height};
  if (!rsvg_handle_render_document(drawing.get(), context.get(), &whole, &error))
    throw InternalError(file.string() + ": librsvg: " + error->message);
  const cairo_status_t status = cairo_surface_write_to_png(picture.get(), file.c_str());
  if (status != CAIRO_STATUS_SUCCESS)
    throw OutputError("cannot write " + file.string() + ": " + cairo_status_to_string(status));
}

}  // namespace mbtfm::statistics
