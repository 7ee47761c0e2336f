#include "substrate/surface/missing.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/thin_plate.h"

namespace mbtfm::surface {
namespace {

std::size_t vertex_of(const HeightMap& map, int i, int j) {
  return static_cast<std::size_t>(j) * map.n_x + static_cast<std::size_t>(i);
}

/// Diameter of the greatest disc without a height, by its middle: half of it is the way to the nearest vertex with one.
struct Hole {
  Vec2 middle_um;
  double width_um = 0;
};

/// Squared distances to the nearest vertex with a height, one axis after the other.
Hole widest_hole(const HeightMap& map) {
  constexpr double kFar = 1e30;
  std::vector<double> squared(map.z_um.size());
  for (int j = 0; j < map.n_y; ++j) {
    double since = kFar;
    const auto pass = [&](int i) {
      const std::size_t at = vertex_of(map, i, j);
      since = std::isnan(map.z_um[at]) ? since + map.spacing_um.x : 0;
      squared[at] = std::min(squared[at], std::min(since * since, kFar));
    };
    for (int i = 0; i < map.n_x; ++i) squared[vertex_of(map, i, j)] = kFar;
    for (int i = 0; i < map.n_x; ++i) pass(i);
    since = kFar;
    for (int i = map.n_x - 1; i >= 0; --i) pass(i);
  }
  Hole widest;
  for (int i = 0; i < map.n_x; ++i) {
    for (int j = 0; j < map.n_y; ++j) {
      double nearest = squared[vertex_of(map, i, j)];
      for (int away = 1; away < map.n_y; ++away) {
        const double across = std::pow(away * map.spacing_um.y, 2);
        if (across >= nearest) break;
        for (const int row : {j - away, j + away}) {
          if (row >= 0 && row < map.n_y) nearest = std::min(nearest, squared[vertex_of(map, i, row)] + across);
        }
      }
      const double width = 2 * std::sqrt(nearest);
      if (width > widest.width_um) widest = {map.place_um(i, j), width};
    }
  }
  return widest;
}

}  // namespace

HeightMap binned(const HeightMap& map, int factor) {
  if (factor == 1) return map;
  HeightMap coarse{.origin_um = map.origin_um + (0.5 * (factor - 1)) * map.spacing_um,
                   .spacing_um = static_cast<double>(factor) * map.spacing_um,
                   .n_x = map.n_x / factor,
                   .n_y = map.n_y / factor,
                   .z_um = {},
                   .sigma_um = {}};
  if (std::min(coarse.n_x, coarse.n_y) < 4)
    throw InvalidData("height map",
                      "at least 4 x 4 blocks of " + std::to_string(factor) + " x " + std::to_string(factor),
                      std::to_string(map.n_x) + " x " + std::to_string(map.n_y) + " vertices");
  for (int j = 0; j < coarse.n_y; ++j) {
    for (int i = 0; i < coarse.n_x; ++i) {
      double sum = 0;
      int n = 0;
      for (int b = 0; b < factor; ++b) {
        for (int a = 0; a < factor; ++a) {
          const double z = map.z_um[vertex_of(map, factor * i + a, factor * j + b)];
          if (std::isnan(z)) continue;
          sum += z;
          ++n;
        }
      }
      coarse.z_um.push_back(2 * n > factor * factor ? sum / n : std::numeric_limits<double>::quiet_NaN());
    }
  }
  return coarse;
}

FilledMap filled(HeightMap map, double widest_um) {
  const auto n = std::ranges::count_if(map.z_um, [](double z) { return std::isnan(z); });
  if (n == 0) return {std::move(map), 0};
  if (n == std::ssize(map.z_um)) throw InvalidData("height map", "heights", "none");
  const Hole hole = widest_hole(map);
  if (hole.width_um > widest_um) {
    throw InvalidData("height map near x, y = " + brief(hole.middle_um.x) + ", " + brief(hole.middle_um.y) + " um",
                      "no hole wider than " + brief(widest_um) +
                          " um (largest_hole_um): cut the map to where it is whole (low_x_um …), or allow wider ones",
                      "none within " + brief(hole.width_um / 2) + " um");
  }
  auto whole = numerics::plate_through(std::move(map.z_um), map.n_x, map.spacing_um.x, map.spacing_um.y);
  if (!whole) throw InvalidData("height map", "holes among heights that hold a plate", "too few heights");
  map.z_um = std::move(*whole);
  return {std::move(map), static_cast<int>(n)};
}

}  // namespace mbtfm::surface
