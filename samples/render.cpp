#include "samples/render.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/parallel.h"

namespace mbtfm::samples {

namespace {

/// Light from the medium and the optics, relative to that of a bright structure.
constexpr double kStrayLight = 0.02;

/// The lamp's profile over the field: brightest off the centre, falling with the square of the distance.
double illumination(const MicroscopeParameters& m, int column, int row) {
  const double x = (column + 0.5) / m.image_size_px - 0.45;
  const double y = (row + 0.5) / m.image_size_px - 0.55;
  return 1 - m.unevenness * 2 * (x * x + y * y);
}

/// Haze, stray light and illumination over an image in focus.
Image through_the_field(const Image& focused, double stray_photons, const MicroscopeParameters& m, int threads) {
  const Image haze = blurred(focused, m.haze_sigma_um, threads);
  Image result = focused;
  parallel_for(result.height, threads, [&](int row) {
    for (int column = 0; column < result.width; ++column) {
      const double light = focused.at(column, row) + m.haze * haze.at(column, row) + stray_photons;
      result.at(column, row) = static_cast<float>(illumination(m, column, row) * light);
    }
  });
  return result;
}

}  // namespace

MicroscopeParameters at_quality(MicroscopeParameters m) {
  if (m.image_quality == "good") {
    m.protein_photons *= 3;
    m.bead_photons *= 3;
    m.haze *= 0.5;
    m.unevenness *= 0.5;
  } else if (m.image_quality == "poor") {
    m.protein_photons /= 3;
    m.bead_photons /= 3;
    m.haze *= 2;
    m.psf_sigma_um *= 4.0 / 3;
    m.bead_sigma_um *= 4.0 / 3;
  }
  return m;
}

Image photons_of(const Image& specimen, const MicroscopeParameters& m, int threads) {
  Image focused = blurred(specimen, m.psf_sigma_um, threads);
  for (float& value : focused.pixels) value *= static_cast<float>(m.protein_photons);
  return through_the_field(focused, kStrayLight * m.protein_photons, m, threads);
}

Image photons_of(const std::vector<Spot>& beads, const MicroscopeParameters& m, int threads) {
  Image focused = blank_image(m.image_size_px, m.pixel_size_um);
  for (const Spot& bead : beads) add_spot(focused, bead);
  return through_the_field(focused, kStrayLight * m.protein_photons, m, threads);
}

Image recorded(const Image& photons, const MicroscopeParameters& m, std::uint64_t seed, int exposure, int threads) {
  Image counts = photons;
  parallel_for(photons.height, threads, [&](int row) {
    // each row has its own stream, so that the number of threads does not matter
    Random random(seed, Stream::camera, static_cast<std::uint64_t>(exposure) << 32 | static_cast<unsigned>(row));
    for (int column = 0; column < photons.width; ++column) {
      const double value = m.camera_offset + m.counts_per_photon * random.poisson(photons.at(column, row)) +
                           m.read_noise * random.normal();
      counts.at(column, row) = static_cast<float>(std::clamp(std::round(value), 0.0, 65535.0));
    }
  });
  return counts;
}

BeadImages bead_spots(const std::vector<Vec2>& relaxed_um, const std::vector<Vec2>& stressed_um,
                      double lost_bead_fraction, const MicroscopeParameters& m, std::uint64_t seed) {
  Random random(seed, Stream::optics, 2);
  const LogNormal brightness{.median = 1, .log_sd = m.bead_brightness_log_sd, .low = 0.3, .high = 3};
  BeadImages images;
  for (std::size_t i = 0; i < relaxed_um.size(); ++i) {
    Spot spot{relaxed_um[i], m.bead_photons * draw(random, brightness), m.bead_sigma_um};
    const double widening = random.uniform(1.5, 2.5);
    if (random.uniform() < m.blurred_bead_fraction) {
      spot.sigma_um *= widening;
      spot.total *= 0.6;
    }
    const double fate = random.uniform();
    if (fate >= 0.5 * lost_bead_fraction) images.relaxed.push_back(spot);
    spot.position_um = stressed_um[i];
    if (fate < 1 - 0.5 * lost_bead_fraction) images.stressed.push_back(spot);
  }
  return images;
}

}  // namespace mbtfm::samples
