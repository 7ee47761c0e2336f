#include "samples/drawing/stack.h"

#include <algorithm>
#include <cmath>

#include "pipeline/numerics/parallel.h"
#include "samples/drawing/random.h"

namespace mbtfm::drawing {
namespace {

void add_bead(images::Image& slice, const GlowingBead& bead, const PointSpread& spread, double above_um,
              double depth_um, double light, Vec2 shift_um, double pixel_um) {
  const double x = (bead.position_um.x + shift_um.x) / pixel_um - 0.5,
               y = (bead.position_um.y + shift_um.y) / pixel_um - 0.5;
  const int reach = static_cast<int>(PointSpread::kReach_um / pixel_um) + 1;
  const int left = std::max(0, static_cast<int>(x) - reach),
            right = std::min(slice.width - 1, static_cast<int>(x) + reach);
  const int top = std::max(0, static_cast<int>(y) - reach),
            bottom = std::min(slice.height - 1, static_cast<int>(y) + reach);
  for (int j = top; j <= bottom; ++j)
    for (int i = left; i <= right; ++i)
      slice.at(i, j) += static_cast<float>(light * spread.at(pixel_um * std::hypot(i - x, j - y), above_um, depth_um));
}

}  // namespace

std::vector<images::Image> recorded_stack(const std::vector<GlowingBead>& beads, const StackMicroscope& m,
                                          const PointSpread& spread, const StageMotion& stage, std::uint64_t seed,
                                          int exposure, int threads) {
  std::vector<images::Image> slices(static_cast<std::size_t>(m.n_slices));
  const double step_um = m.focus_step_um();
  numerics::parallel_for(m.n_slices, threads, [&](int k) {
    images::Image& slice = slices[k];
    slice.width = slice.height = m.image_size_px;
    slice.full_scale = 65535;
    slice.pixel_size_um = m.pixel_size_um;
    slice.z_step_um = m.z_step_um;
    slice.pixels.assign(static_cast<std::size_t>(m.image_size_px) * m.image_size_px,
                        static_cast<float>(m.background_photons));
    const double z_um = m.first_um + (k + 0.5) * step_um;
    const double left = std::pow(1 - m.bleached, exposure + static_cast<double>(k) / m.n_slices);
    const Vec2 shift = stage.shift_um.empty() ? Vec2{} : stage.shift_um[k];
    for (const GlowingBead& bead : beads) {
      const double above = z_um - bead.position_um.z;
      if (std::abs(above) >= PointSpread::kReachAlongZ_um) continue;
      const double depth = std::max(0.0, bead.position_um.z - m.first_um);
      const double light = m.bead_photons * bead.brightness * left * std::exp(-depth / m.attenuation_um);
      add_bead(slice, bead, spread, above, depth, light, shift, m.pixel_size_um);
    }
    for (int j = 0; j < slice.height; ++j) {
      // each row has its own stream, so that the number of threads does not matter
      const auto index = (static_cast<std::uint64_t>(exposure + 16) << 48) | (static_cast<std::uint64_t>(k) << 24) |
                         static_cast<unsigned>(j);
      Random random(seed, Stream::camera, index);
      for (int i = 0; i < slice.width; ++i) {
        const double value =
            m.camera_offset + m.counts_per_photon * random.poisson(slice.at(i, j)) + m.read_noise * random.normal();
        slice.at(i, j) = static_cast<float>(std::clamp(std::round(value), 0.0, 65535.0));
      }
    }
  });
  return slices;
}

}  // namespace mbtfm::drawing
