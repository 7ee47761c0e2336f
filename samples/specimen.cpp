#include <algorithm>
#include <cmath>
#include <numbers>

#include "samples/geometry.h"
#include "samples/render.h"

namespace mbtfm::samples {

namespace {

constexpr double kAdhesionRim_um = 0.06;    ///< the rim of an adhesion is sharper than any light microscope
constexpr double kAdhesionSlope = 0.2;      ///< brighter towards the cell's edge
constexpr double kNucleusRadius_um = 9;     ///< around which the cell is thick
constexpr double kLamella_um = 3;           ///< over which it thins towards its edge
constexpr double kCytosolicPaxillin = 0.3;  ///< where the cell is thickest
constexpr double kSpecks_per_um2 = 0.2;     ///< nascent adhesions and vesicles, too small to count
constexpr double kCytosolicActin = 0.16;
constexpr double kFilaments_per_um2 = 0.8;     ///< thin ones, of the cortical mesh
constexpr double kThinFilament_um = 0.1;       ///< standard deviation of its cross-section
constexpr double kEdgeActin = 0.18;            ///< of the cell's edge
constexpr double kEdgeActin_um = 0.25;         ///< standard deviation of its cross-section
constexpr double kFibreModulation = 0.12;      ///< of a fibre's brightness along it
constexpr double kFullWidthPerSigma = 2.3548;  ///< full width at half maximum of a Gaussian, 2 sqrt(2 ln 2)

Vec2 centroid_of(const Polygon& polygon) {
  Vec2 sum;
  for (const Vec2 p : polygon) sum += p;
  return (1.0 / static_cast<double>(polygon.size())) * sum;
}

/// Relative thickness of the cell: 1 at the nucleus, thin in the lamella, 0 outside; with clouds.
Image thickness_of(const Cell& cell, const MicroscopeParameters& m, Random& random, int threads) {
  Image thickness = coverage_of(cell.outline_um, m.image_size_px, m.pixel_size_um);
  const Image wide = blurred(thickness, kLamella_um, threads);
  const Image clouds = smooth_noise(m.image_size_px, m.pixel_size_um, 0.8, random, threads);
  const Vec2 nucleus = centroid_of(cell.outline_um) + Vec2{2 * random.normal(), 2 * random.normal()};
  for (int row = 0; row < thickness.height; ++row) {
    for (int column = 0; column < thickness.width; ++column) {
      const Vec2 at{(column + 0.5) * m.pixel_size_um, (row + 0.5) * m.pixel_size_um};
      const double bulge = 0.35 + 0.65 * std::exp(-0.5 * std::pow(norm(at - nucleus) / kNucleusRadius_um, 2));
      const double lamella = std::pow(wide.at(column, row), 2);
      const double cloud = std::max(0.2, 1 + 0.12 * clouds.at(column, row));
      thickness.at(column, row) *= static_cast<float>(bulge * lamella * cloud);
    }
  }
  return thickness;
}

/// A point of the cell, anywhere.
Vec2 point_inside(const Polygon& outline, Random& random) {
  double low_x = 1e300, low_y = 1e300, high_x = -1e300, high_y = -1e300;
  for (const Vec2 p : outline) {
    low_x = std::min(low_x, p.x), high_x = std::max(high_x, p.x);
    low_y = std::min(low_y, p.y), high_y = std::max(high_y, p.y);
  }
  while (true) {  // the outline fills more than a tenth of its box
    const Vec2 p{random.uniform(low_x, high_x), random.uniform(low_y, high_y)};
    if (contains(outline, p)) return p;
  }
}

int number_of(double density_per_um2, const Cell& cell) {
  return static_cast<int>(density_per_um2 * std::abs(signed_area_um2(cell.outline_um)));
}

/// A smooth function of the arc length of mean 1: waves of the given standard deviation, from a length up to five of
/// it.
std::function<double(double)> modulation(double strength, double wavelength_um, Random& random) {
  struct Wave {
    double number_per_um, phase_rad;
  };
  std::vector<Wave> waves(4);
  for (Wave& w : waves) {
    w = {2 * std::numbers::pi / (wavelength_um * random.uniform(1, 5)), random.uniform(0, 2 * std::numbers::pi)};
  }
  return [waves, strength](double s) {
    double value = 1;
    for (const Wave& w : waves) value += strength / std::numbers::sqrt2 * std::sin(w.number_per_um * s + w.phase_rad);
    return std::max(0.1, value);
  };
}

void add_fibre_image(Image& image, const Fibre& fibre, Random& random) {
  const double total = length_um(fibre.points_um);
  const auto wave = modulation(kFibreModulation, 1.5, random);
  // a free end frays: half its brightness lies at the very end
  const auto amplitude = [&](double s) {
    double value = fibre.mean_intensity * wave(s);
    if (!fibre.start_adhesion_id) value *= std::min(1.0, 0.5 + s);
    if (!fibre.end_adhesion_id) value *= std::min(1.0, 0.5 + total - s);
    return value;
  };
  add_line(image, resampled(fibre.points_um, 0.5), fibre.width_um / kFullWidthPerSigma, amplitude);
}

/// A fold of the membrane: a wavy band along the edge, a little inside.
void add_ruffle(Image& image, const Polygon& outline, Random& random) {
  const double length = random.uniform(4, 10), depth = random.uniform(0.3, 2), wavelength = random.uniform(1.5, 3);
  const double swing = random.uniform(0.15, 0.4), brightness = random.uniform(0.5, 1.2);
  const int n = static_cast<int>(outline.size()), first = random.below(n);
  const double turn = signed_area_um2(outline) > 0 ? 1 : -1;
  Polyline band;
  double s = 0;
  for (int i = first; s < length && i < first + n; ++i) {
    const Vec2 here = outline[i % n], step = outline[(i + 1) % n] - here;
    const double l = std::max(norm(step), 1e-9);
    const Vec2 inward = (turn / l) * Vec2{-step.y, step.x};
    band.push_back(here + (depth + swing * std::sin(2 * std::numbers::pi * s / wavelength)) * inward);
    s += l;
  }
  const auto wave = modulation(0.3, 1.5, random);
  // it rises and fades over its ends
  const auto amplitude = [&](double t) { return brightness * wave(t) * std::min({1.0, t, std::max(0.0, length - t)}); };
  if (band.size() > 1) add_line(image, resampled(band, 0.2), random.uniform(0.15, 0.35), amplitude);
}

void add_thin_filaments(Image& image, const Cell& cell, Random& random) {
  const Vec2 centre = centroid_of(cell.outline_um);
  for (int i = 0; i < number_of(kFilaments_per_um2, cell); ++i) {
    const Vec2 start = point_inside(cell.outline_um, random);
    const Vec2 outward = start - centre;
    const double turn = random.uniform() < 0.5 ? 0.0 : 0.5 * std::numbers::pi;
    const double angle = std::atan2(outward.y, outward.x) + turn + 0.5 * random.normal();
    const Vec2 end = start + random.uniform(2, 6) * direction(angle);
    const double brightness = 0.03 + 0.14 * std::pow(random.uniform(), 3);
    if (contains(cell.outline_um, end)) {
      add_line(image, {start, end}, kThinFilament_um, [&](double) { return brightness; });
    }
  }
}

}  // namespace

Image paxillin_specimen(const Cell& cell, const MicroscopeParameters& m, std::uint64_t seed, int threads) {
  Random random(seed, Stream::optics, 0);
  Image image = thickness_of(cell, m, random, threads);
  for (float& value : image.pixels) value *= static_cast<float>(kCytosolicPaxillin);
  for (int i = 0; i < number_of(kSpecks_per_um2, cell); ++i) {
    const Vec2 at = point_inside(cell.outline_um, random);
    const double peak = 0.15 * std::pow(random.uniform(), 2);
    const double sigma = random.uniform(0.08, 0.15);
    add_spot(image, {at, peak * 2 * std::numbers::pi * std::pow(sigma / m.pixel_size_um, 2), sigma});
  }
  const Vec2 centre = centroid_of(cell.outline_um);
  for (const Adhesion& a : cell.adhesions) {
    const double outward = dot(a.position_um - centre, direction(a.angle_rad)) > 0 ? 1 : -1;
    add_ellipse(image, a, a.mean_intensity, kAdhesionRim_um, kAdhesionSlope * outward);
  }
  return image;
}

Image actin_specimen(const Cell& cell, int n_ruffles, const MicroscopeParameters& m, std::uint64_t seed, int threads) {
  Random random(seed, Stream::optics, 1);
  Image image = thickness_of(cell, m, random, threads);
  for (float& value : image.pixels) value *= static_cast<float>(kCytosolicActin);
  add_thin_filaments(image, cell, random);
  Polyline edge = cell.outline_um;
  edge.push_back(edge.front());
  const auto ruffles = modulation(0.35, 8, random);
  add_line(image, edge, kEdgeActin_um, [&](double s) { return kEdgeActin * ruffles(s); });
  for (const Fibre& fibre : cell.fibres) add_fibre_image(image, fibre, random);
  for (int i = 0; i < n_ruffles; ++i) add_ruffle(image, cell.outline_um, random);
  return image;
}

}  // namespace mbtfm::samples
