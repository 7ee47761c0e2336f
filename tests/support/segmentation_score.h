/// How well a segmentation finds what is known to be there.
#pragma once

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"
#include "tests/support/test.h"

namespace mbtfm::test {

inline double distance_to_line_um(Vec2 p, const Polyline& line) {
  double nearest = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const Vec2 d = line[i + 1] - line[i];
    const double t = std::clamp(dot(p - line[i], d) / std::max(dot(d, d), 1e-300), 0.0, 1.0);
    nearest = std::min(nearest, norm(p - (line[i] + t * d)));
  }
  return nearest;
}

/// Points every 0.1 um along a line.
inline Polyline densely(const Polyline& line) {
  Polyline points;
  for (std::size_t i = 0; i + 1 < line.size(); ++i) {
    const int n = std::max(1, static_cast<int>(norm(line[i + 1] - line[i]) / 0.1));
    for (int k = 0; k < n; ++k) points.push_back(line[i] + (1.0 * k / n) * (line[i + 1] - line[i]));
  }
  points.push_back(line.back());
  return points;
}

/// Share of `line` within `tolerance_um` of `other`.
inline double covered_share(const Polyline& line, const Polyline& other, double tolerance_um) {
  int n = 0;
  const Polyline points = densely(line);
  for (const Vec2 p : points) n += distance_to_line_um(p, other) <= tolerance_um;
  return 1.0 * n / static_cast<double>(points.size());
}

struct AdhesionScore {
  int n_true = 0, n_found = 0, n_matched = 0;
  double area_ratio = 0;       ///< summed area found over true, of the matched
  double centre_error_um = 0;  ///< root mean square, of the matched
  double angle_error_rad = 0;  ///< root mean square, of the matched whose axes' ratio exceeds 1.5
  std::vector<double> area_errors, centre_errors_um, angle_errors_rad;  ///< of each matched one, magnitudes
  std::vector<int> found_id;                                            ///< by true adhesion; 0: none
  int n_merged = 0;  ///< true ones whose centre lies in a found one that covers another true centre, too
  int n_split = 0;   ///< true ones that cover the centres of two found ones or more
  double f1() const { return 2.0 * n_matched / std::max(1, n_true + n_found); }
};

/// One-to-one, nearest first, where the centres are nearer than half the true minor axis plus 0.1 um.
inline AdhesionScore score_adhesions(const std::vector<Adhesion>& truth, const std::vector<Adhesion>& found) {
  struct Pair {
    double distance;
    std::size_t t, f;
  };
  std::vector<Pair> pairs;
  for (std::size_t t = 0; t < truth.size(); ++t)
    for (std::size_t f = 0; f < found.size(); ++f)
      if (const double d = norm(truth[t].position_um - found[f].position_um); d < truth[t].minor_axis_um / 2 + 0.1)
        pairs.push_back({d, t, f});
  std::sort(pairs.begin(), pairs.end(), [](const Pair& a, const Pair& b) { return a.distance < b.distance; });
  AdhesionScore s;
  s.n_true = static_cast<int>(truth.size());
  s.n_found = static_cast<int>(found.size());
  s.found_id.assign(truth.size(), 0);
  std::vector<bool> is_taken(found.size());
  double true_area = 0, found_area = 0, squares = 0, angles = 0;
  for (const Pair& p : pairs) {
    if (s.found_id[p.t] || is_taken[p.f]) continue;
    s.found_id[p.t] = found[p.f].adhesion_id;
    is_taken[p.f] = true;
    ++s.n_matched;
    true_area += truth[p.t].area_um2;
    found_area += found[p.f].area_um2;
    squares += p.distance * p.distance;
    s.area_errors.push_back(std::abs(found[p.f].area_um2 / truth[p.t].area_um2 - 1));
    s.centre_errors_um.push_back(p.distance);
    if (truth[p.t].major_axis_um > 1.5 * truth[p.t].minor_axis_um) {
      const double turn = std::asin(std::abs(std::sin(truth[p.t].angle_rad - found[p.f].angle_rad)));
      angles += turn * turn;
      s.angle_errors_rad.push_back(turn);
    }
  }
  const auto n_covered = [](const Adhesion& one, const std::vector<Adhesion>& others) {
    return std::ranges::count_if(others, [&](const Adhesion& o) { return covers(one, o.position_um); });
  };
  for (const Adhesion& f : found)
    if (const auto n = static_cast<int>(n_covered(f, truth)); n > 1) s.n_merged += n;
  s.n_split =
      static_cast<int>(std::ranges::count_if(truth, [&](const Adhesion& t) { return n_covered(t, found) > 1; }));
  s.area_ratio = found_area / true_area;
  s.centre_error_um = std::sqrt(squares / std::max(1, s.n_matched));
  s.angle_error_rad = std::sqrt(angles / static_cast<double>(std::max<std::size_t>(1, s.angle_errors_rad.size())));
  return s;
}

/// It is an adhesion, if perhaps merged with another one or a part of one.
inline bool is_true_adhesion(const Adhesion& found, const std::vector<Adhesion>& truth) {
  constexpr double kMargin_um = 0.1;
  return std::ranges::any_of(truth, [&](const Adhesion& t) {
    return covers(t, found.position_um, kMargin_um) || covers(found, t.position_um);
  });
}

/// The middle value; 0 of none.
inline double median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Of all fibres' length, the shares near a line of the other set.
struct LineScore {
  double recall = 0, precision = 0;
  double f1() const { return recall + precision > 0 ? 2 * recall * precision / (recall + precision) : 0; }
};

inline double covered_share(const std::vector<Fibre>& lines, const std::vector<Fibre>& others, double tolerance_um) {
  std::size_t n = 0, n_near = 0;
  for (const Fibre& line : lines)
    for (const Vec2 p : densely(line.points_um)) {
      ++n;
      n_near += std::any_of(others.begin(), others.end(),
                            [&](const Fibre& f) { return distance_to_line_um(p, f.points_um) <= tolerance_um; });
    }
  return n > 0 ? static_cast<double>(n_near) / static_cast<double>(n) : 1;
}

/// At least half of it lies on a true one.
inline bool is_true_fibre(const Fibre& found, const std::vector<Fibre>& truth, double tolerance_um) {
  return 2 * covered_share(std::vector{found}, truth, tolerance_um) >= 1;
}

/// The true one that most of it lies on; none if that is less than half.
inline const Fibre* true_fibre(const Fibre& found, const std::vector<Fibre>& truth, double tolerance_um) {
  const auto share = [&](const Fibre& t) { return covered_share(found.points_um, t.points_um, tolerance_um); };
  const auto best = std::ranges::max_element(truth, {}, share);
  return best != truth.end() && share(*best) >= 0.5 ? &*best : nullptr;
}

inline LineScore score_lines(const std::vector<Fibre>& truth, const std::vector<Fibre>& found, double tolerance_um) {
  return {covered_share(truth, found, tolerance_um), covered_share(found, truth, tolerance_um)};
}

struct FibreScore {
  int n_true = 0;          ///< longer than 4 um
  int n_traced = 0;        ///< … of which one found fibre covers 80 % and lies on for 80 % of its own length
  int n_unclassified = 0;  ///< … and has no type
  int n_type_right = 0;    ///< … and has the type
  int n_typed = 0;         ///< … and is held by the very adhesions
  int n_false = 0;         ///< found, and less than half of it near any true fibre
};

/// @param adhesions  of score_adhesions, to translate the ids at the ends
inline FibreScore score_fibres(const Cell& truth, const Cell& found, const AdhesionScore& adhesions) {
  constexpr double kTolerance_um = 0.4;  // two thirds of a fibre's width
  const auto translated = [&](const std::optional<int>& id) {
    if (!id) return 0;
    for (std::size_t i = 0; i < truth.adhesions.size(); ++i)
      if (truth.adhesions[i].adhesion_id == *id) return adhesions.found_id[i];
    return 0;
  };
  FibreScore s;
  for (const Fibre& t : truth.fibres) {
    if (length_um(t.points_um) <= 4) continue;
    ++s.n_true;
    for (const Fibre& f : found.fibres) {
      if (covered_share(t.points_um, f.points_um, kTolerance_um) < 0.8) continue;
      if (covered_share(f.points_um, t.points_um, kTolerance_um) < 0.8) continue;
      ++s.n_traced;
      s.n_unclassified += f.type == FibreType::unclassified;
      s.n_type_right += t.type == f.type;
      const int a = translated(t.start_adhesion_id), b = translated(t.end_adhesion_id);
      const int c = f.start_adhesion_id.value_or(0), d = f.end_adhesion_id.value_or(0);
      s.n_typed += t.type == f.type && ((a == c && b == d) || (a == d && b == c));
      break;
    }
  }
  for (const Fibre& f : found.fibres) s.n_false += !is_true_fibre(f, truth.fibres, kTolerance_um);
  return s;
}

/// Area in both outlines over area in either, counted on a grid of 0.1 um.
inline double intersection_over_union(const Polygon& a, const Polygon& b) {
  Vec2 low = a[0], high = a[0];
  for (const Polygon* polygon : {&a, &b})
    for (const Vec2 p : *polygon) {
      low = {std::min(low.x, p.x), std::min(low.y, p.y)};
      high = {std::max(high.x, p.x), std::max(high.y, p.y)};
    }
  int n_both = 0, n_either = 0;
  for (double y = low.y; y < high.y; y += 0.1)
    for (double x = low.x; x < high.x; x += 0.1) {
      const bool in_a = contains(a, {x, y}), in_b = contains(b, {x, y});
      n_both += in_a && in_b;
      n_either += in_a || in_b;
    }
  return 1.0 * n_both / n_either;
}

}  // namespace mbtfm::test
