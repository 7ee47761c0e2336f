#include "samples/drawing/raster.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/extent.h"
#include "pipeline/numerics/memory.h"
#include "pipeline/numerics/parallel.h"
#include "samples/drawing/geometry.h"

namespace mbtfm::drawing {

namespace {

/// Gaussians are cut here: the lost tail is 6e-7 of the whole.
constexpr double kReach = 5;

/// Pixels whose centres may lie within `margin_um` of a set of points, clipped to the image.
struct Box {
  int left = 0, top = 0, right = 0, bottom = 0;  ///< right and bottom are excluded
  int width() const { return std::max(0, right - left); }
  int height() const { return std::max(0, bottom - top); }
};

Box box_around(const images::Image& image, const Polyline& points, double margin_um) {
  const double pixel = *image.pixel_size_um;
  const auto [low, high] = extent_of(points);
  const auto clipped = [&](double um, int n) { return static_cast<int>(std::clamp(um / pixel, 0.0, 1.0 * n)); };
  return {clipped(low.x - margin_um, image.width), clipped(low.y - margin_um, image.height),
          clipped(high.x + margin_um + pixel, image.width), clipped(high.y + margin_um + pixel, image.height)};
}

Vec2 centre_of(const images::Image& image, int column, int row) {
  return {(column + 0.5) * *image.pixel_size_um, (row + 0.5) * *image.pixel_size_um};
}

/// Integrals of a unit Gaussian over the pixels first … first+n−1 of one axis.
std::vector<double> pixel_integrals(double position_px, double sigma_px, int first, int n) {
  std::vector<double> integrals(n);
  const double scale = 1 / (std::numbers::sqrt2 * sigma_px);
  double before = std::erf((first - position_px) * scale);
  for (int i = 0; i < n; ++i) {
    const double after = std::erf((first + i + 1 - position_px) * scale);
    integrals[i] = 0.5 * (after - before);
    before = after;
  }
  return integrals;
}

std::vector<float> gaussian_kernel(double sigma_px) {
  const int reach = std::max(1, static_cast<int>(std::ceil(4 * sigma_px)));
  std::vector<double> weights = pixel_integrals(reach + 0.5, sigma_px, 0, 2 * reach + 1);
  double sum = 0;
  for (const double w : weights) sum += w;
  std::vector<float> kernel;
  for (const double w : weights) kernel.push_back(static_cast<float>(w / sum));
  return kernel;
}

}  // namespace

images::Image blank_image(int size_px, double pixel_size_um) {
  constexpr double kImages = 8;  // at a time: the parts of which a picture is made
  numerics::expect_room_for({.what = "the image",
                             .count = static_cast<double>(size_px) * size_px,
                             .parts = "pixels",
                             .bytes_each = kImages * sizeof(float),
                             .remedy = "choose a smaller image_size_px"});
  images::Image image;
  image.width = image.height = size_px;
  image.pixels.assign(static_cast<std::size_t>(size_px) * size_px, 0.0f);
  image.pixel_size_um = pixel_size_um;
  image.full_scale = 65535;
  return image;
}

void add_spot(images::Image& image, const Spot& spot) {
  const Box box = box_around(image, {spot.position_um}, kReach * spot.sigma_um);
  if (box.width() == 0 || box.height() == 0) return;
  const double pixel = *image.pixel_size_um;
  const double sigma_px = spot.sigma_um / pixel;
  const std::vector<double> across = pixel_integrals(spot.position_um.x / pixel, sigma_px, box.left, box.width());
  const std::vector<double> down = pixel_integrals(spot.position_um.y / pixel, sigma_px, box.top, box.height());
  for (int row = 0; row < box.height(); ++row)
    for (int column = 0; column < box.width(); ++column)
      image.at(box.left + column, box.top + row) += static_cast<float>(spot.total * across[column] * down[row]);
}

void add_ellipse(images::Image& image, const Adhesion& ellipse, double amplitude, double rim_um, double slope) {
  constexpr double kDome = 0.2;  // darker by this at the rim than in the middle
  const double a = 0.5 * ellipse.major_axis_um, b = 0.5 * ellipse.minor_axis_um;
  const Vec2 axis = direction(ellipse.angle_rad);
  const Box box = box_around(image, {ellipse.position_um}, a + kReach * rim_um);
  for (int row = box.top; row < box.bottom; ++row) {
    for (int column = box.left; column < box.right; ++column) {
      const Vec2 offset = centre_of(image, column, row) - ellipse.position_um;
      const double u = dot(offset, axis) / a, v = cross(axis, offset) / b;
      const double rho = std::hypot(u, v);
      // distance from the rim, to first order: (rho − 1) / |grad rho|
      const double gradient = rho > 1e-6 ? std::hypot(u / a, v / b) / rho : 1 / b;
      const double distance = (rho - 1) / gradient;
      const double inside = 0.5 * std::erfc(distance / (std::numbers::sqrt2 * rim_um));
      const double shade = 1 - kDome * std::min(1.0, rho * rho) + slope * std::clamp(u, -1.0, 1.0);
      image.at(column, row) += static_cast<float>(amplitude * shade * inside);
    }
  }
}

void add_line(images::Image& image, const Polyline& line, double sigma_um,
              const std::function<double(double)>& amplitude) {
  const Box box = box_around(image, line, kReach * sigma_um);
  if (box.width() == 0 || box.height() == 0) return;
  struct Nearest {
    double distance_um = 1e300;
    double arc_length_um = 0;
  };
  std::vector<Nearest> nearest(static_cast<std::size_t>(box.width()) * box.height());
  double before = 0;
  for (std::size_t k = 1; k < line.size(); ++k) {
    const Vec2 edge = line[k] - line[k - 1];
    const double length = norm(edge);
    const Box part = box_around(image, {line[k - 1], line[k]}, kReach * sigma_um);
    for (int row = part.top; row < part.bottom; ++row) {
      for (int column = part.left; column < part.right; ++column) {
        const Vec2 offset = centre_of(image, column, row) - line[k - 1];
        const double along = std::clamp(dot(offset, edge) / (length * length), 0.0, 1.0);
        const double distance = norm(offset - along * edge);
        Nearest& slot = nearest[static_cast<std::size_t>(row - box.top) * box.width() + column - box.left];
        if (distance < slot.distance_um) slot = {distance, before + along * length};
      }
    }
    before += length;
  }
  for (int row = 0; row < box.height(); ++row) {
    for (int column = 0; column < box.width(); ++column) {
      const Nearest& n = nearest[static_cast<std::size_t>(row) * box.width() + column];
      if (n.distance_um > kReach * sigma_um) continue;
      const double profile = std::exp(-0.5 * std::pow(n.distance_um / sigma_um, 2));
      image.at(box.left + column, box.top + row) += static_cast<float>(profile * amplitude(n.arc_length_um));
    }
  }
}

images::Image coverage_of(const Polygon& polygon, int size_px, double pixel_size_um) {
  constexpr int kSubRows = 8;
  images::Image image = blank_image(size_px, pixel_size_um);
  for (int row = 0; row < size_px * kSubRows; ++row) {
    const double y = (row + 0.5) / kSubRows * pixel_size_um;
    std::vector<double> crossings_px;
    for (std::size_t i = 0; i < polygon.size(); ++i) {
      const Vec2 a = polygon[i], b = polygon[(i + 1) % polygon.size()];
      if ((a.y > y) == (b.y > y)) continue;
      crossings_px.push_back(
          std::clamp((a.x + (b.x - a.x) * (y - a.y) / (b.y - a.y)) / pixel_size_um, 0.0, static_cast<double>(size_px)));
    }
    std::ranges::sort(crossings_px);
    for (std::size_t i = 0; i + 1 < crossings_px.size(); i += 2) {
      const double from = crossings_px[i], to = crossings_px[i + 1];
      for (int column = static_cast<int>(from); column < to; ++column) {
        const double part = std::min(to, column + 1.0) - std::max<double>(from, column);
        image.at(column, row / kSubRows) += static_cast<float>(part / kSubRows);
      }
    }
  }
  return image;
}

images::Image blurred(const images::Image& image, double sigma_um, int threads) {
  const std::vector<float> kernel = gaussian_kernel(sigma_um / *image.pixel_size_um);
  const int reach = static_cast<int>(kernel.size()) / 2;
  images::Image across = image, result = image;
  numerics::parallel_for(image.height, threads, [&](int row) {
    std::vector<float> padded(image.width + 2 * reach);
    for (int i = 0; i < static_cast<int>(padded.size()); ++i)
      padded[i] = image.at(std::clamp(i - reach, 0, image.width - 1), row);
    // weight by weight over the whole row: the compiler turns this order into vector instructions
    float* sum = &across.at(0, row);
    std::fill_n(sum, image.width, 0.0f);
    for (std::size_t k = 0; k < kernel.size(); ++k)
      for (int column = 0; column < image.width; ++column) sum[column] += kernel[k] * padded[column + k];
  });
  numerics::parallel_for(image.height, threads, [&](int row) {
    std::vector<float> sum(image.width, 0.0f);
    for (int k = -reach; k <= reach; ++k) {
      const float weight = kernel[k + reach];
      const float* from =
          &across.pixels[static_cast<std::size_t>(std::clamp(row + k, 0, image.height - 1)) * image.width];
      for (int column = 0; column < image.width; ++column) sum[column] += weight * from[column];
    }
    std::ranges::copy(sum, &result.at(0, row));
  });
  return result;
}

images::Image smooth_noise(int size_px, double pixel_size_um, double sigma_um, Random& random, int threads) {
  images::Image image = blank_image(size_px, pixel_size_um);
  for (float& value : image.pixels) value = static_cast<float>(random.normal());
  image = blurred(image, sigma_um, threads);
  // white noise after a Gaussian has the standard deviation 1 / (2 sqrt(pi) sigma) of before
  const auto scale = static_cast<float>(2 * std::sqrt(std::numbers::pi) * sigma_um / pixel_size_um);
  for (float& value : image.pixels) value *= scale;
  return image;
}

}  // namespace mbtfm::drawing
