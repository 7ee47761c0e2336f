#include "pipeline/contract/polyline.h"

#include <algorithm>
#include <limits>

namespace mbtfm {

Vec2 point_along_um(const Polyline& line_um, double share) {
  double left_um = share * length_um(line_um);
  for (std::size_t i = 0; i + 1 < line_um.size(); ++i) {
    const Vec2 step = line_um[i + 1] - line_um[i];
    if (left_um <= norm(step) && norm(step) > 0) return line_um[i] + (left_um / norm(step)) * step;
    left_um -= norm(step);
  }
  return line_um.back();
}

double distance_to_line_um(const Polyline& line_um, Vec2 point_um) {
  double nearest_um = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < line_um.size(); ++i) {
    nearest_um = std::min(nearest_um, distance_to_segment_um(point_um, line_um[i], line_um[i + 1]));
  }
  return nearest_um;
}

std::vector<Vec2> label_places_um(const Fibre& fibre, const std::vector<Fibre>& fibres, double clear_um) {
  std::vector<Vec2> places;
  for (const double share : {0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8}) {
    places.push_back(point_along_um(fibre.points_um, share));
  }
  std::stable_partition(places.begin(), places.end(), [&](Vec2 place) {
    return std::none_of(fibres.begin(), fibres.end(), [&](const Fibre& other) {
      return other.fibre_id != fibre.fibre_id && distance_to_line_um(other.points_um, place) < clear_um;
    });
  });
  return places;
}

}  // namespace mbtfm
