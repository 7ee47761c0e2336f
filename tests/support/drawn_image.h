/// Images with known content: ellipses and lines with blurred rims on an even ground, camera noise.
#pragma once

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"
#include "pipeline/contract/polyline.h"
#include "segment/images/image.h"
#include "tests/support/segmentation_score.h"

namespace mbtfm::test {

inline images::Image even_image(int width, int height, float level) {
  images::Image image;
  image.width = width;
  image.height = height;
  image.pixels.assign(static_cast<std::size_t>(width) * static_cast<std::size_t>(height), level);
  return image;
}

inline Vec2 centre_of_pixel_um(int column, int row, double pixel_um) {
  return {(column + 0.5) * pixel_um, (row + 0.5) * pixel_um};
}

/// An ellipse whose rim is a blurred step: half of `height` lies on the rim.
inline void draw_ellipse(images::Image& image, const Adhesion& e, double height, double blur_um, double pixel_um) {
  const double a = e.major_axis_um / 2, b = e.minor_axis_um / 2;
  const Vec2 axis{std::cos(e.angle_rad), std::sin(e.angle_rad)};
  for (int row = 0; row < image.height; ++row)
    for (int column = 0; column < image.width; ++column) {
      const Vec2 d = centre_of_pixel_um(column, row, pixel_um) - e.position_um;
      const double u = dot(d, axis), v = cross(axis, d), q = std::hypot(u / a, v / b);
      const double distance = q > 1e-6 ? (q - 1) * q / std::hypot(u / (a * a), v / (b * b)) : -b;
      image.at(column, row) += static_cast<float>(height / 2 * std::erfc(distance / (std::numbers::sqrt2 * blur_um)));
    }
}

/// A line of Gaussian profile with this full width at half maximum, its ends cut straight across or round.
inline void draw_line(images::Image& image, const Polyline& line, double height, double width_um, double pixel_um) {
  const double sigma = width_um / 2.3548;
  for (int row = 0; row < image.height; ++row)
    for (int column = 0; column < image.width; ++column) {
      const double d = distance_to_line_um(centre_of_pixel_um(column, row, pixel_um), line) / sigma;
      if (d < 6) image.at(column, row) += static_cast<float>(height * std::exp(-d * d / 2));
    }
}

inline void add_noise(images::Image& image, double sigma, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;  // of its own sigma none may be 0
  for (float& value : image.pixels) value += static_cast<float>(sigma * normal(random));
}

inline Adhesion ellipse(int id, Vec2 position_um, double major_um, double minor_um, double angle_rad) {
  Adhesion a;
  a.adhesion_id = id;
  a.position_um = position_um;
  a.major_axis_um = major_um;
  a.minor_axis_um = minor_um;
  a.angle_rad = angle_rad;
  a.area_um2 = std::numbers::pi / 4 * major_um * minor_um;
  return a;
}

/// A disc-shaped cell of 10 um radius in a field of 25.6 um (0.1 um a pixel): adhesions near the edge, two fibres that
/// cross, one that ends freely.
struct DrawnScene {
  static constexpr double kPixel_um = 0.1;
  std::vector<Adhesion> adhesions;
  std::vector<Polyline> fibres;
  images::Image adhesion_image, actin_image;
};

inline DrawnScene drawn_scene(double noise, std::uint64_t seed) {
  DrawnScene s;
  s.adhesions = {ellipse(1, {7, 8}, 1.6, 0.6, 0.6), ellipse(2, {18.5, 18}, 1.6, 0.6, 0.7),
                 ellipse(3, {18.5, 7.5}, 1.8, 0.7, 2.4), ellipse(4, {7, 18.5}, 1.4, 0.7, 2.3),
                 ellipse(5, {12.8, 4.5}, 1.2, 0.5, 1.5)};
  s.fibres = {{{7, 8}, {18.5, 18}}, {{18.5, 7.5}, {7, 18.5}}, {{12.8, 4.5}, {13.4, 10.5}}};
  s.adhesion_image = even_image(256, 256, 100);
  s.actin_image = even_image(256, 256, 100);
  const Adhesion cell = ellipse(1, {12.8, 12.8}, 20, 20, 0);
  draw_ellipse(s.adhesion_image, cell, 100, 0.15, s.kPixel_um);
  draw_ellipse(s.actin_image, cell, 200, 0.15, s.kPixel_um);
  for (const Adhesion& a : s.adhesions) draw_ellipse(s.adhesion_image, a, 500, 0.13, s.kPixel_um);
  for (const Polyline& f : s.fibres) draw_line(s.actin_image, f, 500, 0.6, s.kPixel_um);
  add_noise(s.adhesion_image, noise, 2 * seed);
  add_noise(s.actin_image, noise, 2 * seed + 1);
  return s;
}

/// The image with each pixel (column, row) at `map` of them; for maps of a field onto itself.
template <class Map>
images::Image mapped(const images::Image& image, Map map) {
  images::Image result = image;
  for (int row = 0; row < image.height; ++row)
    for (int column = 0; column < image.width; ++column) {
      const auto [c, r] = map(column, row);
      result.at(c, r) = image.at(column, row);
    }
  return result;
}

}  // namespace mbtfm::test
