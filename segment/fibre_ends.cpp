#include "segment/fibre_ends.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "segment/ellipse.h"

namespace mbtfm::segment {

namespace {

/// The adhesion that an end reaches best.
struct Hold {
  const Adhesion* adhesion = nullptr;
  double distance_um = std::numeric_limits<double>::infinity();  ///< from the end, or its straight continuation
};

double squared_distance_to_segment(Vec2 p, Vec2 a, Vec2 b) {
  const Vec2 d = b - a;
  const double t = std::clamp(dot(p - a, d) / std::max(dot(d, d), 1e-300), 0.0, 1.0);
  const Vec2 r = p - (a + t * d);
  return dot(r, r);
}

/// Distance to the ellipse of the nearest point on the course of the line around its last point: `reach_um` back along
/// the line, `reach_um` straight ahead; what lies ahead counts with the way there.
double distance_on_course(const Adhesion& adhesion, const Polyline& line, double reach_um) {
  constexpr double kStep = 0.1;  // um
  const std::size_t n = line.size();
  Vec2 back = line[n - 1];
  double nearest = std::max(0.0, distance_to_ellipse_um(adhesion, back));
  double gone = 0;
  for (std::size_t i = n - 1; i-- > 0 && gone < reach_um;) {
    const double l = norm(line[i] - line[i + 1]);
    for (double s = kStep; s < l && gone + s < reach_um; s += kStep)
      nearest = std::min(
          nearest, std::max(0.0, distance_to_ellipse_um(adhesion, line[i + 1] + (s / l) * (line[i] - line[i + 1]))) +
                       0.3 * (gone + s));
    gone += l;
    back = line[i];
  }
  const double l = norm(line[n - 1] - back);
  if (l <= 0) return nearest;
  const Vec2 ahead = (1 / l) * (line[n - 1] - back);
  for (double s = kStep; s <= reach_um; s += kStep)
    nearest = std::min(nearest, std::max(0.0, distance_to_ellipse_um(adhesion, line[n - 1] + s * ahead)) + 0.7 * s);
  return nearest;
}

Hold hold_of(const Polyline& line, const std::vector<Adhesion>& adhesions, double reach_um) {
  Hold best;
  for (const Adhesion& a : adhesions) {
    const double far = 2 * reach_um + a.major_axis_um;
    if (norm(a.position_um - line.back()) > far) continue;
    const double distance = distance_on_course(a, line, reach_um);
    // between two that the line touches, the one whose centre it passes nearer
    const double centre = std::sqrt(squared_distance_to_segment(a.position_um, line[line.size() - 2], line.back()));
    const double cost = distance + 0.2 * std::min(centre, norm(a.position_um - line.back()));
    if (cost < best.distance_um) best = {&a, cost};
  }
  return best;
}

/// Let the line end at the centre: leave out the last points that lie past it or within a micrometre of it.
void lead_to(Polyline& line, const Adhesion& adhesion) {
  const Vec2 centre = adhesion.position_um;
  std::size_t nearest = 0;
  for (std::size_t i = 1; i < line.size(); ++i)
    if (norm(line[i] - centre) < norm(line[nearest] - centre)) nearest = i;
  line.resize(nearest + 1);
  const double clear = std::max(0.5, adhesion.major_axis_um / 2);
  while (line.size() > 1 && norm(line.back() - centre) < clear) line.pop_back();
  line.push_back(centre);
}

/// 1 far from the decision's border, ½ on it.
double certainty(double distance_um, double reach_um) {
  const double margin = std::abs(distance_um - reach_um) / (reach_um / 3);
  return std::isfinite(margin) ? 0.5 * (1 + std::erf(margin / std::sqrt(2.0))) : 1;
}

}  // namespace

void tie_ends(Fibre& fibre, const std::vector<Adhesion>& adhesions, double reach_um) {
  Polyline& line = fibre.points_um;
  Hold end = hold_of(line, adhesions, reach_um);
  std::reverse(line.begin(), line.end());
  Hold start = hold_of(line, adhesions, reach_um);
  fibre.confidence = certainty(start.distance_um, reach_um) * certainty(end.distance_um, reach_um);
  if (start.adhesion == end.adhesion && start.adhesion != nullptr)
    (start.distance_um <= end.distance_um ? end : start) = Hold{};
  fibre.start_adhesion_id.reset();
  fibre.end_adhesion_id.reset();
  if (start.adhesion && start.distance_um <= reach_um) {
    lead_to(line, *start.adhesion);
    fibre.start_adhesion_id = start.adhesion->adhesion_id;
  }
  std::reverse(line.begin(), line.end());
  if (end.adhesion && end.distance_um <= reach_um) {
    lead_to(line, *end.adhesion);
    fibre.end_adhesion_id = end.adhesion->adhesion_id;
  }
  const int n_tied = fibre.start_adhesion_id.has_value() + fibre.end_adhesion_id.has_value();
  fibre.type = n_tied == 2 ? FibreType::ventral : n_tied == 1 ? FibreType::dorsal : FibreType::arc;
}

}  // namespace mbtfm::segment
