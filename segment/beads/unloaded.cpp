#include "segment/beads/unloaded.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::beads {
namespace {

constexpr double kNormalOfMedian = 1.4826;  // standard deviation of a normal variable over its median magnitude
constexpr int kRegions = 4;                 // a side

/// Of the means over regions about the drift, the part that the beads' own noise does not make.
double shared_um(const DisplacementField& good, Vec2 drift_um, double noise_um, double width_um, double height_um) {
  struct Region {
    Vec2 sum;
    int n = 0;
  };
  std::vector<Region> regions(kRegions * kRegions);
  const auto index = [](double at, double size) {
    return std::clamp(static_cast<int>(kRegions * at / size), 0, kRegions - 1);
  };
  for (const Bead& b : good) {
    Region& r = regions[kRegions * index(b.position_um.y, height_um) + index(b.position_um.x, width_um)];
    r.sum += b.displacement_um - drift_um;
    ++r.n;
  }
  double squares = 0, n = 0;
  for (const Region& r : regions) {
    if (r.n == 0) continue;
    const Vec2 mean = (1.0 / r.n) * r.sum;
    squares += 0.5 * dot(mean, mean) - noise_um * noise_um / r.n;
    ++n;
  }
  return std::sqrt(std::max(0.0, squares / std::max(1.0, n)));
}

}  // namespace

UnloadedPlace unloaded_place(const Tracking& tracking, double width_um, double height_um) {
  constexpr std::size_t kFewest = 10;
  DisplacementField good;
  std::vector<double> x, y, magnitudes;
  double squares = 0;
  for (const Bead& b : tracking.field) {
    if (!b.flag.empty()) continue;
    good.push_back(b);
    x.push_back(b.displacement_um.x), y.push_back(b.displacement_um.y);
    squares += b.sigma_um * b.sigma_um;
  }
  if (good.size() < kFewest)
    throw InvalidData("the beads", "at least " + std::to_string(kFewest) + " that both pictures show",
                      std::to_string(good.size()));
  const auto n = static_cast<double>(good.size()), area_um2 = width_um * height_um;
  const Vec2 rest{numerics::median(x), numerics::median(y)};  // the tracker has taken its drift off already
  for (const Bead& b : good)
    for (const double of : {b.displacement_um.x - rest.x, b.displacement_um.y - rest.y})
      magnitudes.push_back(std::abs(of));
  UnloadedPlace place;
  place.noise_um = kNormalOfMedian * numerics::median_in(magnitudes);
  // of 2n normal numbers the median magnitude has a relative variance of 1.36 / 2n
  place.noise_error = std::sqrt(1.36 / (2 * n));
  place.stated_um = std::sqrt(squares / n);
  place.beads_per_um2 = n / area_um2;
  place.found_per_um2 = static_cast<double>(tracking.field.size()) / area_um2;
  place.share_lost = 1 - n / static_cast<double>(tracking.field.size());
  place.drift_um = tracking.common.drift_um + rest;
  place.shared_um = shared_um(good, rest, place.noise_um, width_um, height_um);
  return place;
}

bool is_moving(const UnloadedPlace& place) { return place.shared_um > place.noise_um / 3; }

}  // namespace mbtfm::beads
