/// Inside of the bead tracker: grey values as floats.
#pragma once

#include <functional>
#include <vector>

#include "pipeline/contract/geometry.h"
#include "pipeline/numerics/near.h"
#include "segment/images/image.h"

namespace mbtfm::beads {

/// Grey values, row by row. Coordinates are px, 0 at the centre of the first pixel.
struct Plane {
  int width = 0;
  int height = 0;
  std::vector<float> values;
  const float* row(int j) const { return values.data() + static_cast<std::size_t>(j) * width; }
  float at(int i, int j) const { return row(j)[i]; }
};

/// The image less its Gaussian average over `sigma` px: light that varies slowly is gone.
Plane without_background(const images::Image& image, double sigma);

/// The cubic spline through an image's values.
struct Spline {
  Plane coefficients;  ///< with a margin of one before and two after, mirrored
  float last_x = 0, last_y = 0;
};

Spline spline_through(const Plane& plane, int threads);
/// An image as a smooth function: its values and slopes at the pixels, and the spline between them.
struct SmoothImage {
  Plane plane, slope_x, slope_y;
  Spline spline;
};
SmoothImage smooth_image(Plane plane, int threads);

/// Gaussian average.
Plane blurred(const Plane& plane, double sigma);

/// Standard deviation of the pixels' noise where the image is dark.
double noise_of(const Plane& plane);

/// Gaussian sigma (px) of a bead's picture: from the ratios of the autocorrelation at lags 1, sqrt 2 and 2, whose zero
/// lag alone carries the noise; the median over tiles, so that a bright clump does not decide. 0: nothing but noise.
double bead_sigma_of(const Plane& plane);

/// Vertex of the parabola through three values of which the middle one is highest, within half a pixel of it.
double parabola_vertex(double before, double here, double after);

using Neighbours = numerics::Neighbours<Vec2>;

/// Call body(from, to) for strips of 0 … n; the strips do not depend on the threads.
void in_strips(int n, int threads, const std::function<void(int from, int to)>& body);

}  // namespace mbtfm::beads
