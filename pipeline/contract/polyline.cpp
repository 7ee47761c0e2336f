#include "pipeline/contract/polyline.h"

#include <algorithm>
#include <cmath>
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
  for (std::size_t i = 0; i + 1 < line_um.size(); ++i)
    nearest_um = std::min(nearest_um, distance_to_segment_um(point_um, line_um[i], line_um[i + 1]));
  return nearest_um;
}

std::vector<Vec2> label_places_um(const Fibre& fibre, const std::vector<Fibre>& fibres, double clear_um) {
  std::vector<Vec2> places;
  for (const double share : {0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8})
    places.push_back(point_along_um(fibre.points_um, share));
  std::stable_partition(places.begin(), places.end(), [&](Vec2 place) {
    return std::ranges::none_of(fibres, [&](const Fibre& other) {
      return other.fibre_id != fibre.fibre_id && distance_to_line_um(other.points_um, place) < clear_um;
    });
  });
  return places;
}

std::vector<double> even_division_um(double length_um, const std::function<double(double)>& size_um, int fewest) {
  std::vector<double> at = {0};
  std::vector<double> count = {0};  // of edges up to there: the integral of 1 / h
  constexpr double kStep = 0.25;    // of an edge: h grows by at most a third over it
  double inverse = 1 / size_um(0);
  while (at.back() < length_um) {
    const double next = std::min(length_um, at.back() + kStep / inverse);
    const double next_inverse = 1 / size_um(next);
    count.push_back(count.back() + 0.5 * (next - at.back()) * (inverse + next_inverse));
    at.push_back(next);
    inverse = next_inverse;
  }
  const int pieces = std::max(fewest, static_cast<int>(std::lround(count.back())));
  std::vector<double> division;
  std::size_t k = 0;
  for (int i = 1; i < pieces; ++i) {
    const double wanted = count.back() * i / pieces;
    while (count[k + 1] < wanted) ++k;
    division.push_back(at[k] + (at[k + 1] - at[k]) * (wanted - count[k]) / (count[k + 1] - count[k]));
  }
  return division;
}

Polygon evenly_resampled(const Polygon& polygon, int n) {
  double perimeter = 0;
  const std::size_t size = polygon.size();
  for (std::size_t i = 0; i < size; ++i) perimeter += norm(polygon[(i + 1) % size] - polygon[i]);
  Polygon points;
  points.reserve(n);
  double start = 0;
  for (std::size_t i = 0; i < size; ++i) {
    const Vec2 a = polygon[i];
    const Vec2 step = polygon[(i + 1) % size] - a;
    const double length = norm(step);
    while (static_cast<int>(points.size()) < n) {
      const double s = perimeter * static_cast<double>(points.size()) / n;
      if (s >= start + length) break;
      points.push_back(a + ((s - start) / length) * step);
    }
    start += length;
  }
  while (static_cast<int>(points.size()) < n) points.push_back(polygon.front());  // rounding at the very end
  return points;
}

}  // namespace mbtfm
