#include "network/mesh/polyline.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pipeline/contract/polyline.h"

namespace mbtfm::mesh {

Polyline simplified(const Polyline& points_um, double tolerance_um) {
  const int n = static_cast<int>(points_um.size());
  if (n < 3) return points_um;
  std::vector<char> is_kept(n, 0);
  is_kept.front() = is_kept.back() = 1;
  std::vector<std::pair<int, int>> open = {{0, n - 1}};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    int furthest = first;
    double largest = tolerance_um;
    for (int i = first + 1; i < last; ++i) {
      const double distance = distance_to_segment_um(points_um[i], points_um[first], points_um[last]);
      if (distance > largest) {
        largest = distance;
        furthest = i;
      }
    }
    if (furthest == first) continue;
    is_kept[furthest] = 1;
    open.push_back({first, furthest});
    open.push_back({furthest, last});
  }
  Polyline kept;
  for (int i = 0; i < n; ++i)
    if (is_kept[i]) kept.push_back(points_um[i]);
  return kept;
}

Polyline without_short_pieces(Polyline points_um, double shortest_um) {
  while (points_um.size() > 2) {
    // of the shortest piece, the inner end whose loss moves the line less
    std::size_t piece = 1;
    for (std::size_t i = 1; i < points_um.size(); ++i)
      if (norm(points_um[i] - points_um[i - 1]) < norm(points_um[piece] - points_um[piece - 1])) piece = i;
    if (norm(points_um[piece] - points_um[piece - 1]) >= shortest_um) break;
    std::size_t lost = piece;
    if (piece == points_um.size() - 1) {
      lost = piece - 1;
    } else if (piece > 1) {
      const double first = distance_to_segment_um(points_um[piece - 1], points_um[piece - 2], points_um[piece]);
      const double second = distance_to_segment_um(points_um[piece], points_um[piece - 1], points_um[piece + 1]);
      lost = first < second ? piece - 1 : piece;
    }
    points_um.erase(points_um.begin() + static_cast<std::ptrdiff_t>(lost));
  }
  return points_um;
}

Polyline evenly_divided(const Polyline& points_um, const SizeField& size, int fewest) {
  std::vector<double> start = {0};
  for (std::size_t i = 1; i < points_um.size(); ++i)
    start.push_back(start.back() + norm(points_um[i] - points_um[i - 1]));
  const auto at = [&](double s) {
    const auto next = std::upper_bound(start.begin() + 1, start.end() - 1, s);
    const auto i = next - start.begin();
    return points_um[i - 1] + ((s - start[i - 1]) / (start[i] - start[i - 1])) * (points_um[i] - points_um[i - 1]);
  };
  Polyline inner;
  for (const double s : even_division_um(
           start.back(), [&](double s) { return size.at(at(s)); }, fewest))
    inner.push_back(at(s));
  return inner;
}

Polyline densified(const Polyline& points_um, double longest_um) {
  Polyline dense;
  for (std::size_t i = 0; i + 1 < points_um.size(); ++i) {
    const Vec2 step = points_um[i + 1] - points_um[i];
    const int pieces = std::max(1, static_cast<int>(std::ceil(norm(step) / longest_um)));
    for (int k = 0; k < pieces; ++k) dense.push_back(points_um[i] + (static_cast<double>(k) / pieces) * step);
  }
  dense.push_back(points_um.back());
  return dense;
}

}  // namespace mbtfm::mesh
