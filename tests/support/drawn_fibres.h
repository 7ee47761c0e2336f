/// Fibres that experts drew on a real cell, and how well a segmentation agrees with them.
#pragma once

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"
#include "pipeline/files/csv.h"
#include "tests/support/test.h"

namespace mbtfm::test {

/// A point on a line, the line's direction there and its type.
struct LinePoint {
  Vec2 position_um;
  double angle_rad = 0;
  std::string type;
};

inline std::vector<LinePoint> read_drawn_fibres(const std::filesystem::path& file, double pixel_um) {
  const files::CsvTable table(file);
  std::vector<LinePoint> points;
  for (int i = 0; i < table.n_rows(); ++i)
    points.push_back({pixel_um * Vec2{table.number(i, "x_px") + 0.5, table.number(i, "y_px") + 0.5},
                      table.number(i, "angle_deg") * std::numbers::pi / 180, table.text(i, "type")});
  return points;
}

/// Points 0.2 um apart; their type is empty where the fibre has none.
inline std::vector<LinePoint> line_points(const std::vector<Fibre>& fibres) {
  constexpr double kStep_um = 0.2;
  std::vector<LinePoint> points;
  for (const Fibre& f : fibres) {
    double next = 0, gone = 0;
    for (std::size_t i = 0; i + 1 < f.points_um.size(); ++i) {
      const Vec2 a = f.points_um[i], d = f.points_um[i + 1] - a;
      const double l = norm(d);
      for (; next < gone + l; next += kStep_um)
        points.push_back({a + ((next - gone) / l) * d, std::atan2(d.y, d.x),
                          f.type == FibreType::unclassified ? "" : std::string(name_of(f.type))});
      gone += l;
    }
  }
  return points;
}

/// The drawing was read off a screenshot, and 14 % of its points have a direction more than 20 degrees off their
/// neighbours'. Here each has the mean direction of those of its type within 1.5 um.
inline std::vector<LinePoint> with_even_directions(const std::vector<LinePoint>& drawn) {
  constexpr double kNear_um = 1.5;
  std::vector<LinePoint> even = drawn;
  for (LinePoint& p : even) {
    double x = 0, y = 0;
    for (const LinePoint& q : drawn) {
      if (q.type != p.type || norm(q.position_um - p.position_um) > kNear_um) continue;
      x += std::cos(2 * q.angle_rad);
      y += std::sin(2 * q.angle_rad);
    }
    p.angle_rad = std::atan2(y, x) / 2;
  }
  return even;
}

/// A point of either side is met where the other has one within 0.8 um and 20 degrees.
struct DrawnScore {
  double recall = 0, precision = 0, right_type = 0;  ///< the latter of those that have a type
  std::map<std::string, double> recall_of;           ///< by the drawn type
};

inline DrawnScore score_drawn(const std::vector<LinePoint>& drawn, const std::vector<LinePoint>& found) {
  constexpr double kNear_um = 0.8, kAngle_rad = 20 * std::numbers::pi / 180;
  const auto meets = [&](const LinePoint& a, const LinePoint& b) {
    return norm(a.position_um - b.position_um) <= kNear_um &&
           std::abs(std::remainder(a.angle_rad - b.angle_rad, std::numbers::pi)) <= kAngle_rad;
  };
  DrawnScore score;
  std::map<std::string, int> n_of;
  for (const LinePoint& d : drawn) {
    const bool is_met = std::ranges::any_of(found, [&](const LinePoint& f) { return meets(d, f); });
    ++n_of[d.type];
    score.recall_of[d.type] += is_met;
    score.recall += is_met;
  }
  for (auto& [type, n] : score.recall_of) n /= n_of[type];
  score.recall /= static_cast<double>(drawn.size());
  int n_met = 0, n_typed = 0, n_right = 0;
  for (const LinePoint& f : found) {
    const LinePoint* nearest = nullptr;
    for (const LinePoint& d : drawn)
      if (meets(d, f) && (!nearest || norm(d.position_um - f.position_um) < norm(nearest->position_um - f.position_um)))
        nearest = &d;
    n_met += nearest != nullptr;
    n_typed += nearest != nullptr && !f.type.empty();
    n_right += nearest != nullptr && nearest->type == f.type;
  }
  score.precision = static_cast<double>(n_met) / static_cast<double>(std::max<std::size_t>(1, found.size()));
  score.right_type = static_cast<double>(n_right) / std::max(1, n_typed);
  return score;
}

}  // namespace mbtfm::test
