#include "samples/drawing/render.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "pipeline/numerics/parallel.h"
#include "segment/images/channels.h"

namespace mbtfm::drawing {

namespace {

/// Light from the medium and the optics, relative to that of a bright structure.
constexpr double kStrayLight = 0.02;

/// Linear between pixel centres, which lie at whole numbers; beyond the border its values go on.
double between_pixels(const images::Image& image, double x, double y) {
  const double u = std::clamp(x, 0.0, image.width - 1.0), v = std::clamp(y, 0.0, image.height - 1.0);
  const int i = std::min(static_cast<int>(u), image.width - 2), j = std::min(static_cast<int>(v), image.height - 2);
  if (i < 0 || j < 0) return image.at(std::max(i, 0), std::max(j, 0));
  const double a = u - i, b = v - j;
  return (1 - b) * ((1 - a) * image.at(i, j) + a * image.at(i + 1, j)) +
         b * ((1 - a) * image.at(i, j + 1) + a * image.at(i + 1, j + 1));
}

/// The lamp's profile over the field: brightest off the centre, falling with the square of the distance.
double illumination(const MicroscopeParameters& m, int column, int row) {
  const double x = (column + 0.5) / m.image_size_px - 0.45;
  const double y = (row + 0.5) / m.image_size_px - 0.55;
  return 1 - m.unevenness * 2 * (x * x + y * y);
}

/// Light that falls with the inverse cube of the distance: Gaussians of doubling width and halving weight, each of
/// them on pixels of a quarter of its width.
images::Image tail_of(const images::Image& focused, const MicroscopeParameters& m, int threads) {
  constexpr int kGaussians = 4;
  images::Image tail = blank_image(m.image_size_px, m.pixel_size_um);
  double sigma_um = m.haze_sigma_um, weight = 1 / (2 - std::pow(0.5, kGaussians - 1));
  for (int i = 0; i < kGaussians; ++i, sigma_um *= 2, weight /= 2) {
    const int factor = std::clamp(static_cast<int>(sigma_um / m.pixel_size_um / 4), 1, images::kLargestBinning);
    const images::Image wide = blurred(images::binned(focused, std::min(factor, m.image_size_px)), sigma_um, threads);
    for (int row = 0; row < tail.height; ++row) {
      for (int column = 0; column < tail.width; ++column) {
        tail.at(column, row) += static_cast<float>(
            weight * between_pixels(wide, (column + 0.5) / factor - 0.5, (row + 0.5) / factor - 0.5));
      }
    }
  }
  return tail;
}

/// Haze, stray light and illumination over an image in focus.
images::Image through_the_field(const images::Image& focused, double stray_photons, const MicroscopeParameters& m,
                                int threads) {
  const images::Image haze = blurred(focused, m.haze_sigma_um, threads);
  const std::optional<images::Image> tail =
      m.haze_tail > 0 ? std::optional(tail_of(focused, m, threads)) : std::nullopt;
  images::Image result = focused;
  numerics::parallel_for(result.height, threads, [&](int row) {
    for (int column = 0; column < result.width; ++column) {
      double light = focused.at(column, row) + m.haze * haze.at(column, row) + stray_photons;
      if (tail) light += m.haze_tail * tail->at(column, row);
      result.at(column, row) = static_cast<float>(illumination(m, column, row) * light);
    }
  });
  return result;
}

}  // namespace

MicroscopeParameters at_quality(MicroscopeParameters m) {
  if (m.image_quality == ImageQuality::good) {
    m.protein_photons *= 3;
    m.bead_photons *= 3;
    m.haze *= 0.5;
    m.haze_tail *= 0.5;
    m.unevenness *= 0.5;
  } else if (m.image_quality == ImageQuality::poor) {
    m.protein_photons /= 3;
    m.bead_photons /= 3;
    m.haze *= 2;
    m.haze_tail *= 2;
    m.psf_sigma_um *= 4.0 / 3;
    m.bead_sigma_um *= 4.0 / 3;
  }
  return m;
}

images::Image photons_of(const images::Image& specimen, const MicroscopeParameters& m, int threads) {
  images::Image focused = blurred(specimen, m.psf_sigma_um, threads);
  for (float& value : focused.pixels) value *= static_cast<float>(m.protein_photons);
  return through_the_field(focused, kStrayLight * m.protein_photons, m, threads);
}

images::Image photons_of(const std::vector<Spot>& beads, const MicroscopeParameters& m, int threads) {
  images::Image focused = blank_image(m.image_size_px, m.pixel_size_um);
  for (const Spot& bead : beads) add_spot(focused, bead);
  return through_the_field(focused, kStrayLight * m.protein_photons, m, threads);
}

images::Image recorded(const images::Image& photons, const MicroscopeParameters& m, std::uint64_t seed, int exposure,
                       int threads) {
  images::Image counts = photons;
  if (m.scan_phase_px != 0) counts = images::without_scan_phase(photons, -m.scan_phase_px);
  numerics::parallel_for(photons.height, threads, [&](int row) {
    // each row has its own stream, so that the number of threads does not matter
    Random random(seed, Stream::camera, static_cast<std::uint64_t>(exposure) << 32 | static_cast<unsigned>(row));
    for (int column = 0; column < photons.width; ++column) {
      const double value = m.camera_offset +
                           m.counts_per_photon * random.poisson(std::max(0.0f, counts.at(column, row))) +
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

}  // namespace mbtfm::drawing
