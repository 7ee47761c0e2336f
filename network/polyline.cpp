#include "network/polyline.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>
#include <vector>

namespace mbtfm::network {

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
  for (int i = 0; i < n; ++i) {
    if (is_kept[i]) kept.push_back(points_um[i]);
  }
  return kept;
}

Polyline without_short_pieces(Polyline points_um, double shortest_um) {
  while (points_um.size() > 2) {
    // of the shortest piece, the inner end whose loss moves the line less
    std::size_t piece = 1;
    for (std::size_t i = 1; i < points_um.size(); ++i) {
      if (norm(points_um[i] - points_um[i - 1]) < norm(points_um[piece] - points_um[piece - 1])) piece = i;
    }
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

Polyline evenly_divided(const Polyline& points_um, double edge_um) {
  constexpr double kKink = 25 * std::numbers::pi / 180;
  Polyline even = {points_um.front()};
  std::size_t from = 0;
  for (std::size_t i = 1; i < points_um.size(); ++i) {
    if (i + 1 < points_um.size()) {
      const Vec2 before = points_um[i] - points_um[i - 1];
      const Vec2 after = points_um[i + 1] - points_um[i];
      if (std::abs(std::atan2(cross(before, after), dot(before, after))) < kKink) continue;
    }
    const Polyline run(points_um.begin() + static_cast<std::ptrdiff_t>(from),
                       points_um.begin() + static_cast<std::ptrdiff_t>(i) + 1);
    const double length = length_um(run);
    const int pieces = std::max(1, static_cast<int>(std::lround(length / edge_um)));
    std::size_t k = 0;
    double start = 0;
    for (int piece = 1; piece < pieces; ++piece) {
      const double s = length * piece / pieces;
      while (k + 2 < run.size() && start + norm(run[k + 1] - run[k]) < s) {
        start += norm(run[k + 1] - run[k]);
        ++k;
      }
      const Vec2 step = run[k + 1] - run[k];
      even.push_back(run[k] + ((s - start) / norm(step)) * step);
    }
    even.push_back(run.back());
    from = i;
  }
  return even;
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

}  // namespace mbtfm::network
