#include "segment/cells/ellipse.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mbtfm::cells {
namespace {

struct Moments {
  double area = 0, x = 0, y = 0, xx = 0, yy = 0, xy = 0, intensity = 0;
};

Moments moments_of(const std::vector<CoveredPixel>& pixels) {
  Moments m;
  for (const CoveredPixel& p : pixels) {
    m.area += p.share;
    m.x += p.share * p.column;
    m.y += p.share * p.row;
    m.intensity += p.share * p.intensity;
  }
  m.x /= m.area;
  m.y /= m.area;
  m.intensity /= m.area;
  for (const CoveredPixel& p : pixels) {
    const double dx = p.column - m.x, dy = p.row - m.y;
    m.xx += p.share * dx * dx;
    m.yy += p.share * dy * dy;
    m.xy += p.share * dx * dy;
  }
  m.xx = m.xx / m.area + 1.0 / 12;
  m.yy = m.yy / m.area + 1.0 / 12;
  m.xy /= m.area;
  return m;
}

/// `point` in the ellipse's own axes.
Vec2 along_axes(const Adhesion& a, Vec2 point_um) {
  const Vec2 d = point_um - a.position_um, e{std::cos(a.angle_rad), std::sin(a.angle_rad)};
  return {dot(d, e), cross(e, d)};
}

}  // namespace

Adhesion measure_ellipse(const std::vector<CoveredPixel>& pixels, double pixel_size_um) {
  const Moments m = moments_of(pixels);
  const double mean = (m.xx + m.yy) / 2, half_difference = std::hypot((m.xx - m.yy) / 2, m.xy);
  const double major = 4 * std::sqrt(mean + half_difference);
  const double minor = 4 * std::sqrt(std::max(mean - half_difference, 1e-12 * mean));
  const double scale = std::sqrt(m.area / (std::numbers::pi / 4 * major * minor)) * pixel_size_um;
  Adhesion adhesion;
  adhesion.position_um = {(m.x + 0.5) * pixel_size_um, (m.y + 0.5) * pixel_size_um};
  adhesion.area_um2 = m.area * pixel_size_um * pixel_size_um;
  adhesion.major_axis_um = major * scale;
  adhesion.minor_axis_um = minor * scale;
  adhesion.angle_rad = std::atan2(2 * m.xy, m.xx - m.yy) / 2;
  adhesion.eccentricity = std::sqrt(std::max(0.0, 1 - (minor / major) * (minor / major)));
  adhesion.mean_intensity = m.intensity;
  return adhesion;
}

double distance_to_ellipse_um(const Adhesion& adhesion, Vec2 point_um) {
  const Vec2 p = along_axes(adhesion, point_um);
  const double a = adhesion.major_axis_um / 2, b = adhesion.minor_axis_um / 2;
  const double q = std::hypot(p.x / a, p.y / b);
  if (q < 1e-9) return -b;
  // q is 1 on the rim; |grad q| turns its excess into a distance
  return (q - 1) * q / std::hypot(p.x / (a * a), p.y / (b * b));
}

}  // namespace mbtfm::cells
