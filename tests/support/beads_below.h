/// Beads in a gel's volume, below a surface that is known.
#pragma once

#include "pipeline/contract/geometry.h"
#include "tests/support/test.h"

namespace mbtfm::test {

constexpr double kBeadField_um = 60;  ///< half of the field; and the depth to which beads lie
constexpr double kBeadSigma_um = 0.3;

/// Evenly drawn, z with an error of kBeadSigma_um.
inline std::vector<Vec3> beads_below(const std::function<double(Vec2)>& height, double density_per_um3, unsigned seed) {
  std::mt19937_64 random(seed);
  constexpr double kHalf = kBeadField_um, kBase = kBeadField_um, kTop = -20;
  std::uniform_real_distribution<double> across(-kHalf, kHalf), down(kTop, kBase);
  std::normal_distribution<double> noise(0, kBeadSigma_um);
  const int n = std::poisson_distribution<int>(density_per_um3 * 4 * kHalf * kHalf * (kBase - kTop))(random);
  std::vector<Vec3> beads;
  for (int k = 0; k < n; ++k) {
    const Vec3 at = {across(random), across(random), down(random)};
    if (at.z > height({at.x, at.y})) beads.push_back({at.x, at.y, at.z + noise(random)});
  }
  return beads;
}

using HeightOf = std::function<double(Vec2)>;

struct Misfit {
  double mean_um = 0, rms_um = 0;
};
/// Over the field without 15 um at its edges.
inline Misfit misfit_of(const HeightOf& surface, const HeightOf& height) {
  Misfit sum;
  int n = 0;
  for (double y = -45; y <= 45; y += 1.5)
    for (double x = -45; x <= 45; x += 1.5, ++n) {
      const double error = surface({x, y}) - height({x, y});
      sum.mean_um += error;
      sum.rms_um += error * error;
    }
  return {sum.mean_um / n, std::sqrt(sum.rms_um / n)};
}

}  // namespace mbtfm::test
