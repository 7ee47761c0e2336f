/// Small stacks of beads with known places, and beads without pictures.
#pragma once

#include "samples/drawing/stack.h"
#include "segment/stacks/track.h"
#include "tests/support/test.h"

namespace mbtfm::test {

struct StackScene {
  drawing::StackMicroscope microscope;
  std::vector<drawing::GlowingBead> relaxed, stressed;

  double field_um() const { return microscope.pixel_size_um * microscope.image_size_px; }
  double depth_um() const { return microscope.focus_step_um() * microscope.n_slices; }
  std::vector<images::Image> stack(bool is_stressed, std::uint64_t seed, const drawing::StageMotion& stage = {}) const {
    const drawing::PointSpread spread(microscope.optics, depth_um(), microscope.pixel_size_um, 1);
    return drawing::recorded_stack(is_stressed ? stressed : relaxed, microscope, spread, stage, seed,
                                   is_stressed ? 0 : 1, 1);
  }
};

/// Beads evenly in a small stack; where they go is a function of their place.
inline StackScene stack_scene(int n_beads, unsigned seed, const std::function<Vec3(Vec3)>& displacement) {
  StackScene scene;
  scene.microscope.image_size_px = 144;
  scene.microscope.n_slices = 44;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> normal;
  for (int k = 0; k < n_beads; ++k) {
    const Vec3 place{scene.field_um() * unit(random), scene.field_um() * unit(random), scene.depth_um() * unit(random)};
    const double light = std::exp(0.25 * normal(random));
    scene.relaxed.push_back({place, light});
    scene.stressed.push_back({place + displacement(place), light});
  }
  return scene;
}

struct BeadClouds {
  std::vector<stacks::PlacedBead> relaxed, stressed;  ///< the first ones of both are partners
  std::vector<Vec3> displacement;                     ///< true, of those
};

/// Beads in 100 x 100 x 50 um with errors; a share of each cloud has no partner.
inline BeadClouds bead_clouds(int n_beads, double sigma_um, double lost, unsigned seed,
                              const std::function<Vec3(Vec3)>& displacement) {
  BeadClouds clouds;
  std::mt19937_64 random(seed);
  std::uniform_real_distribution<double> unit(0, 1);
  std::normal_distribution<double> normal;
  const auto place = [&] { return Vec3{100 * unit(random), 100 * unit(random), 50 * unit(random)}; };
  const auto error = [&] {
    return Vec3{sigma_um * normal(random), sigma_um * normal(random), 3 * sigma_um * normal(random)};
  };
  for (int k = 0; k < n_beads; ++k) {
    const Vec3 x = place();
    clouds.displacement.push_back(displacement(x));
    clouds.relaxed.push_back({x + error(), 0, sigma_um, 3 * sigma_um});
    clouds.stressed.push_back({x + clouds.displacement.back() + error(), 0, sigma_um, 3 * sigma_um});
  }
  const int n_lost = static_cast<int>(lost * n_beads);
  for (int k = 0; k < n_lost; ++k) {
    const Vec3 x = place();
    clouds.relaxed.push_back({x, 0, sigma_um, 3 * sigma_um});
    const Vec3 y = place();
    clouds.stressed.push_back({y + displacement(y), 0, sigma_um, 3 * sigma_um});
  }
  return clouds;
}

}  // namespace mbtfm::test
