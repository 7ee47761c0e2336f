#include "pipeline/report/match_fibres.h"

#include <algorithm>
#include <tuple>

#include "pipeline/contract/polyline.h"

namespace mbtfm::report {
namespace {

/// Mean over a's length of the distance from b: midpoints of pieces no longer than step_um, weighted by length.
double directed_distance_um(const Polyline& a, const Polyline& b, double step_um) {
  double sum = 0, length = 0;
  for (std::size_t i = 1; i < a.size(); ++i) {
    const double piece = norm(a[i] - a[i - 1]);
    const int n = std::max(1, static_cast<int>(std::ceil(piece / step_um)));
    for (int k = 0; k < n; ++k) sum += piece / n * distance_to_line_um(b, a[i - 1] + (k + 0.5) / n * (a[i] - a[i - 1]));
    length += piece;
  }
  return sum / length;
}

}  // namespace

double line_distance_um(const Polyline& a, const Polyline& b, double step_um) {
  return std::max(directed_distance_um(a, b, step_um), directed_distance_um(b, a, step_um));
}

std::vector<FibreMatch> match_fibres(const std::vector<Fibre>& found, const std::vector<Fibre>& truth,
                                     const FibreMatchParameters& parameters) {
  std::vector<FibreMatch> candidates;
  for (int i = 0; i < static_cast<int>(found.size()); ++i) {
    for (int k = 0; k < static_cast<int>(truth.size()); ++k) {
      const double distance = line_distance_um(found[i].points_um, truth[k].points_um, parameters.step_um);
      if (distance <= parameters.largest_distance_um) candidates.push_back({i, k, distance});
    }
  }
  std::ranges::sort(candidates, [](const FibreMatch& a, const FibreMatch& b) {
    return std::tie(a.distance_um, a.found_index, a.true_index) < std::tie(b.distance_um, b.found_index, b.true_index);
  });
  std::vector<bool> is_found_taken(found.size()), is_true_taken(truth.size());
  std::vector<FibreMatch> matches;
  for (const FibreMatch& candidate : candidates) {
    if (is_found_taken[candidate.found_index] || is_true_taken[candidate.true_index]) continue;
    is_found_taken[candidate.found_index] = is_true_taken[candidate.true_index] = true;
    matches.push_back(candidate);
  }
  return matches;
}

}  // namespace mbtfm::report
