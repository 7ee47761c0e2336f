#include "segment/cells/ellipse.h"

#include <numbers>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/order_statistics.h"

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

Adhesion ellipse_of_polygon(const Polygon& polygon) {
  const Vec2 origin = polygon.front();  // near, so that no digits are lost
  double area = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec2 a = polygon[i] - origin, b = polygon[(i + 1) % polygon.size()] - origin;
    const double c = cross(a, b);
    area += c / 2;
    x += c * (a.x + b.x) / 6;
    y += c * (a.y + b.y) / 6;
    xx += c * (a.x * a.x + a.x * b.x + b.x * b.x) / 12;
    yy += c * (a.y * a.y + a.y * b.y + b.y * b.y) / 12;
    xy += c * (a.x * b.y + 2 * a.x * a.y + 2 * b.x * b.y + b.x * a.y) / 24;
  }
  MBTFM_ASSERT(area != 0);
  const Vec2 centre{x / area, y / area};
  const double m_xx = xx / area - centre.x * centre.x, m_yy = yy / area - centre.y * centre.y,
               m_xy = xy / area - centre.x * centre.y;
  const double mean = (m_xx + m_yy) / 2, half_difference = std::hypot((m_xx - m_yy) / 2, m_xy);
  const double ratio = std::sqrt((mean - half_difference) / (mean + half_difference));
  if (!(ratio > 0)) throw InvalidData("polygon", "a line that does not cross itself", "negative second moments");
  Adhesion adhesion;
  adhesion.position_um = origin + centre;
  adhesion.area_um2 = std::abs(area);
  adhesion.major_axis_um = std::sqrt(adhesion.area_um2 / ratio * 4 / std::numbers::pi);
  adhesion.minor_axis_um = ratio * adhesion.major_axis_um;
  adhesion.angle_rad = std::atan2(2 * m_xy, m_xx - m_yy) / 2;
  adhesion.eccentricity = std::sqrt(std::max(0.0, 1 - ratio * ratio));
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

std::optional<double> level_around(const Adhesion& adhesion, const images::Image& image, double pixel_um,
                                   const std::function<bool(int, int, Vec2)>& is_background) {
  constexpr double kBlur_um = 0.3, kRing_um = 1;  // the ring begins where the resolution of light has faded
  const double reach_um = adhesion.major_axis_um / 2 + kRing_um;
  const Vec2 low = adhesion.position_um - Vec2{reach_um, reach_um},
             high = adhesion.position_um + Vec2{reach_um, reach_um};
  std::vector<float> around;
  for (int j = pixel_at(low.y, pixel_um, image.height); j <= pixel_at(high.y, pixel_um, image.height); ++j) {
    for (int i = pixel_at(low.x, pixel_um, image.width); i <= pixel_at(high.x, pixel_um, image.width); ++i) {
      const Vec2 centre_um{(i + 0.5) * pixel_um, (j + 0.5) * pixel_um};
      if (!is_background(i, j, centre_um)) continue;
      const double distance_um = distance_to_ellipse_um(adhesion, centre_um);
      if (distance_um >= kBlur_um && distance_um <= kRing_um) around.push_back(image.at(i, j));
    }
  }
  if (around.empty()) return std::nullopt;
  return numerics::median_in(around);
}

}  // namespace mbtfm::cells
