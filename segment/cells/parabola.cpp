#include "segment/cells/parabola.h"

#include <algorithm>

namespace mbtfm::cells {

std::vector<cv::Point2d> last_part(const Trace& trace, LineEnd end, double length_px) {
  const auto n = static_cast<std::ptrdiff_t>(std::min(static_cast<double>(trace.size()), length_px));
  if (end == LineEnd::first) return {trace.points.begin(), trace.points.begin() + n};
  return {trace.points.rbegin(), trace.points.rbegin() + n};
}

Parabola parabola_through(const std::vector<cv::Point2d>& a, const std::vector<cv::Point2d>& b) {
  Parabola fit;
  const cv::Point2d way = b.back() - a.back();
  fit.origin = (a.front() + b.front()) / 2;
  fit.along = way / std::max(1e-9, std::hypot(way.x, way.y));
  cv::Matx33d normal = cv::Matx33d::zeros();
  cv::Vec3d right(0, 0, 0);
  const auto each = [&](auto use) {
    for (const auto* part : {&a, &b})
      for (const cv::Point2d& p : *part) {
        const cv::Point2d d = p - fit.origin;
        use(d.dot(fit.along), fit.along.cross(d), 0.5 / static_cast<double>(part->size()));
      }
  };
  each([&](double s, double t, double weight) {
    const cv::Vec3d powers(1, s, s * s);
    normal += weight * powers * powers.t();
    right += weight * t * powers;
  });
  fit.coefficients = normal.solve(right, cv::DECOMP_SVD);
  double squares = 0;
  each([&](double s, double t, double weight) { squares += weight * (t - fit.offset(s)) * (t - fit.offset(s)); });
  fit.misfit_px = std::sqrt(squares);
  fit.from = fit.along.dot(a.front() - fit.origin);
  fit.to = fit.along.dot(b.front() - fit.origin);
  return fit;
}

Trace bridge_of(const Parabola& way, const Ridges& ridges) {
  Trace bridge;
  for (double s = way.from + 1; s < way.to; ++s) {
    bridge.points.push_back(way.at(s));
    bridge.height.push_back(ridges.at(way.at(s), way.angle_rad(s)));
    bridge.is_shared.push_back(false);
  }
  return bridge;
}

}  // namespace mbtfm::cells
