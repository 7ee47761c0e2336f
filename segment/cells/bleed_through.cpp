#include "segment/cells/bleed_through.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "pipeline/numerics/order_statistics.h"
#include "segment/cells/grid.h"

namespace mbtfm::cells {
namespace {

constexpr double kBeside_um = 0.5;  // beyond what the microscope blurs

double contrast(const cv::Mat& image, Vec2 at_um, Vec2 across, double half_width_um, double pixel_um) {
  const Vec2 aside = (half_width_um + kBeside_um) * across;
  const auto brightness = [&](Vec2 point) { return sample(image, to_pixels(point, pixel_um)); };
  return brightness(at_um) - 0.5 * (brightness(at_um + aside) + brightness(at_um - aside));
}

/// Of a fibre's points, away from its ends, which adhesions hold.
void add_contrasts(std::vector<double>& contrasts, const cv::Mat& image, const Fibre& fibre, double pixel_um,
                   double step_um) {
  constexpr double kEnd_um = 3;
  const double whole_um = length_um(fibre.points_um);
  double before_um = 0, next_um = kEnd_um;
  for (std::size_t i = 1; i < fibre.points_um.size(); ++i) {
    const Vec2 from = fibre.points_um[i - 1], chord = fibre.points_um[i] - from;
    const double length = norm(chord);
    const Vec2 along = (1 / length) * chord;
    for (; next_um < std::min(before_um + length, whole_um - kEnd_um); next_um += step_um) {
      const Vec2 at = from + (next_um - before_um) * along;
      contrasts.push_back(contrast(image, at, {-along.y, along.x}, 0.5 * fibre.width_um, pixel_um));
    }
    before_um += length;
  }
}

}  // namespace

std::optional<double> contrast_of_fibres(const images::Image& adhesion, const Cell& cell, double pixel_um) {
  constexpr double kStep_um = 0.2, kEnough_um = 10;
  const cv::Mat image = matrix_of(adhesion);
  std::vector<double> of_fibres, of_adhesions;
  for (const Fibre& fibre : cell.fibres) add_contrasts(of_fibres, image, fibre, pixel_um, kStep_um);
  for (const Adhesion& a : cell.adhesions) {
    if (is_assumed(a.origin)) continue;
    const Vec2 across{-std::sin(a.angle_rad), std::cos(a.angle_rad)};
    of_adhesions.push_back(contrast(image, a.position_um, across, 0.5 * a.minor_axis_um, pixel_um));
  }
  if (of_adhesions.empty() || static_cast<double>(of_fibres.size()) * kStep_um < kEnough_um) return std::nullopt;
  const double bright = numerics::median_in(of_adhesions);
  if (bright <= 0) return std::nullopt;
  return numerics::median_in(of_fibres) / bright;
}

}  // namespace mbtfm::cells
