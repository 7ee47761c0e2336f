#include "segment/cells/fibre_probability.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace mbtfm::cells {

std::array<double, 7> terms_of(const FibreEvidence& e) {
  constexpr double kMostSure = 10;  // beyond it texture is no question any more
  return {1,
          std::min(kMostSure, -e.log_false),
          std::log(std::max(e.length_um, 1.0)),
          std::log(std::max(e.relative_height, 0.05)),
          e.share_beside,
          e.cortex,
          std::log(e.n_fibres + 0.5)};
}

double probability_of(const FibreEvidence& evidence) {
  constexpr std::array kCoefficients{-2.07, 0.629, 0.593, 0.123, 0.893, -7.87, 1.376};
  return logistic(terms_of(evidence), kCoefficients);
}

double cortex_along(const Polyline& line, const Polygon& outline_um) {
  if (outline_um.empty() || line.size() < 2) return 0;
  constexpr double kParallel = 0.5;  // sine of 30°
  constexpr double kFalls_um = 2;
  constexpr std::size_t kEach = 3;  // point: they are a pixel apart
  double n = 0, n_along = 0, nearest_um = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i + 1 < line.size(); i += kEach, ++n) {
    const Vec2 along = line[i + 1] - line[i], away = line[i] - nearest_on_boundary_um(outline_um, line[i]);
    n_along += std::abs(dot(along, away)) <= kParallel * norm(along) * norm(away);
    nearest_um = std::min(nearest_um, norm(away));
  }
  return n_along / n * std::exp(-nearest_um / kFalls_um);
}

}  // namespace mbtfm::cells
