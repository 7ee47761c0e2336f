/// Which true fibres a segmentation misses, breaks or takes for another type, and what is special where it does.
#pragma once

#include "pipeline/contract/polyline.h"
#include "tests/support/segmentation_accuracy.h"

namespace mbtfm::test {

struct FibreLosses {
  struct OfType {
    int n = 0, n_traced = 0;
    double length_um = 0, lost_um = 0;
    std::map<std::string, int> taken_for;
  };
  std::map<std::string, OfType> of_type;
  std::map<std::string, double> length_um, lost_um;        ///< by circumstance, the first that holds
  std::map<std::string, std::pair<int, double>> untraced;  ///< number and length, by what was found instead
  int n_cells = 0;
};

/// What is special at a point of a fibre: the first of these that holds.
inline std::string circumstance(const SimulatedCell& cell, const Fibre& fibre, const Polyline& points, std::size_t i) {
  constexpr double kBeside_um = 1, kAlongside = 0.26, kFaint = 0.7, kEnd_um = 2, kEdge_um = 2;
  const auto direction = [](const Polyline& l, std::size_t k) {
    const Vec2 d = l[std::min(k + 5, l.size() - 1)] - l[k > 4 ? k - 5 : 0];
    return (1 / std::max(norm(d), 1e-9)) * d;
  };
  bool is_crossed = false;
  for (const Fibre& other : cell.truth.fibres) {
    if (other.fibre_id == fibre.fibre_id || distance_to_line_um(points[i], other.points_um) > kBeside_um) continue;
    const Polyline others = densely(other.points_um);
    const auto nearer = [&](Vec2 a, Vec2 b) { return norm(a - points[i]) < norm(b - points[i]); };
    const auto k = static_cast<std::size_t>(std::ranges::min_element(others, nearer) - others.begin());
    if (std::abs(cross(direction(points, i), direction(others, k))) < kAlongside)
      return "another within 1 um alongside";
    is_crossed = true;
  }
  if (distance_to_boundary_um(cell.truth.outline_um, points[i]) < kEdge_um) return "within 2 um of the edge";
  if (fibre.mean_intensity < kFaint) return "fainter than 0.7 of the median";
  if (cell.nucleus.distance(points[i]) < 1) return "over the nucleus";
  const double from_end = 0.1 * static_cast<double>(std::min(i, points.size() - 1 - i));
  if (from_end < kEnd_um) return "last 2 um of the fibre";
  return is_crossed ? "another within 1 um across" : "none of these";
}

inline void add_losses(FibreLosses& losses, const SimulatedCell& cell, const Cell& found) {
  constexpr double kNear_um = 0.25, kTolerance_um = 0.4, kMost = 0.8;
  ++losses.n_cells;
  for (const Fibre& t : cell.truth.fibres) {
    FibreLosses::OfType& of = losses.of_type[std::string(name_of(t.type))];
    const Polyline points = densely(t.points_um);
    const double step_um = length_um(t.points_um) / static_cast<double>(points.size());
    of.length_um += length_um(t.points_um);
    for (std::size_t i = 0; i < points.size(); ++i) {
      const std::string where = circumstance(cell, t, points, i);
      const bool is_found = std::ranges::any_of(
          found.fibres, [&](const Fibre& f) { return distance_to_line_um(points[i], f.points_um) <= kNear_um; });
      losses.length_um[where] += step_um;
      if (is_found) continue;
      losses.lost_um[where] += step_um;
      of.lost_um += step_um;
    }
    if (length_um(t.points_um) <= 4) continue;
    ++of.n;
    const Fibre* traced = nullptr;
    bool runs_on = false;
    for (const Fibre& f : found.fibres) {
      if (covered_share(t.points_um, f.points_um, kTolerance_um) < kMost) continue;
      if (covered_share(f.points_um, t.points_um, kTolerance_um) >= kMost) {
        traced = &f;
        break;
      }
      runs_on = true;
    }
    if (traced) {
      ++of.n_traced;
      ++of.taken_for[std::string(name_of(traced->type))];
      continue;
    }
    const double share = covered_share(std::vector{t}, found.fibres, kTolerance_um);
    auto& [n, length] = losses.untraced[runs_on          ? "a line that runs on over another fibre"
                                        : share >= kMost ? "several pieces that cover it"
                                        : share >= 0.3   ? "a part of it"
                                                         : "nothing (less than 30 % of it)"];
    ++n;
    length += length_um(t.points_um);
  }
}

inline void print(const FibreLosses& l) {
  std::printf("\n%-10s %7s %7s %10s   traced ones taken for\n", "type", "fibres", "recall", "one piece");
  for (const auto& [type, of] : l.of_type) {
    std::printf("%-10s %7d %7.3f %10.3f  ", type.c_str(), of.n, 1 - of.lost_um / of.length_um,
                1.0 * of.n_traced / std::max(1, of.n));
    for (const auto& [taken, n] : of.taken_for) std::printf(" %s %d", taken.c_str(), n);
    std::printf("\n");
  }
  double all = 0;
  for (const auto& [where, um] : l.lost_um) all += um;
  std::printf("\nlength lost (%.0f um a cell), by the first that holds there\n", all / l.n_cells);
  std::vector<std::pair<double, std::string>> order;
  for (const auto& [where, um] : l.lost_um) order.emplace_back(um, where);
  std::ranges::sort(order, std::greater{});
  for (const auto& [um, where] : order)
    std::printf("  %-34s %5.1f %% of the loss; %5.1f %% of such length is lost\n", where.c_str(), 100 * um / all,
                100 * um / l.length_um.at(where));
  std::printf("\nfibres not in one piece: in their place is found\n");
  for (const auto& [what, of] : l.untraced)
    std::printf("  %-42s %4d fibres, %6.0f um\n", what.c_str(), of.first, of.second);
}

}  // namespace mbtfm::test
