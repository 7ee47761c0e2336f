/// Paints shapes, given in um, into an image. A pixel (column i, row j) has its centre at (i+½, j+½) pixel sizes.
/// All functions add to what is there; what lies outside the image is cut off.
#pragma once

#include <functional>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"
#include "pipeline/contract/results.h"
#include "samples/drawing/random.h"
#include "segment/images/image.h"

namespace mbtfm::drawing {

using images::Image;

/// An image of zeros.
images::Image blank_image(int size_px, double pixel_size_um);

/// A Gaussian spot, integrated over each pixel: its centroid is its position, its sum `total`.
struct Spot {
  Vec2 position_um;
  double total = 0;
  double sigma_um = 0;
};
void add_spot(images::Image& image, const Spot& spot);

/// An ellipse of brightness `amplitude`, domed a little, with a rim of `rim_um` (half the brightness lies on the
/// ellipse itself) and brighter by `slope` at the end of its major axis that points along its angle.
void add_ellipse(images::Image& image, const Adhesion& ellipse, double amplitude, double rim_um, double slope);

/// A line of Gaussian cross-section (standard deviation `sigma_um`); `amplitude` by arc length in um.
void add_line(images::Image& image, const Polyline& line, double sigma_um,
              const std::function<double(double arc_length_um)>& amplitude);

/// The share of each pixel that a polygon covers: 1 inside, 0 outside.
images::Image coverage_of(const Polygon& polygon, int size_px, double pixel_size_um);

/// The image after a Gaussian; beyond its border it goes on with its border's values.
images::Image blurred(const images::Image& image, double sigma_um, int threads);

/// Smooth Gaussian noise of mean 0 and standard deviation 1, correlated over `sigma_um`.
images::Image smooth_noise(int size_px, double pixel_size_um, double sigma_um, Random& random, int threads);

}  // namespace mbtfm::drawing
