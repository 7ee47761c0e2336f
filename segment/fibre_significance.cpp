#include "segment/fibre_significance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "segment/grid.h"

namespace mbtfm::segment {

double significance(const Ridges& ridges, const std::vector<cv::Point2d>& points, const std::vector<double>& height,
                    double independent_px) {
  if (points.empty()) return 0;
  double sum = 0;
  for (std::size_t i = 0; i < points.size(); ++i)
    sum += height[i] / std::max<double>(sample(ridges.noise, points[i]), 1e-30);
  const auto n = static_cast<double>(points.size());
  return sum / n * std::sqrt(n / independent_px);
}

double expected_false_lines(double significance, double area_um2) {
  // The strongest chains of a texture have an exponential tail. Density and scale were counted in 24 simulated cells of
  // meshwork alone (71 000 um², scenario no-fibres, three image qualities), where it holds from 10 lines a cell to 0.1.
  constexpr double kDensity_per_um2 = 0.0036, kAt = 10.7, kScale = 1.35;
  return kDensity_per_um2 * area_um2 * std::exp((kAt - significance) / kScale);
}

bool winds(const Polyline& line_um) {
  constexpr double kStep_um =
      1;  // longer than the noise of a centreline, shorter than a ruffle's wave (1.5 um and more)
  constexpr double kWinding_per_um = 0.03;  // twice the median of the centrelines of straight fibres
  double turning = 0, net = 0, length = 0, last_angle = 0;
  Vec2 from = line_um.front();
  bool has_angle = false;
  for (const Vec2 p : line_um) {
    const Vec2 d = p - from;
    if (norm(d) < kStep_um) continue;
    const double angle = std::atan2(d.y, d.x);
    if (has_angle) {
      const double turn = std::remainder(angle - last_angle, 2 * std::numbers::pi);
      turning += std::abs(turn);
      net += turn;
    }
    has_angle = true;
    last_angle = angle;
    from = p;
    length += norm(d);
  }
  return turning - std::abs(net) > kWinding_per_um * length;
}

}  // namespace mbtfm::segment
