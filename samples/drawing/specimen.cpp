#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/extent.h"
#include "samples/drawing/geometry.h"
#include "samples/drawing/render.h"

namespace mbtfm::drawing {

namespace {

constexpr double kAdhesionRim_um = 0.06;    ///< the rim of an adhesion is sharper than any light microscope
constexpr double kAdhesionSlope = 0.2;      ///< brighter towards the cell's edge
constexpr double kNucleusRadius_um = 9;     ///< around which the cell is thick
constexpr double kLamella_um = 3;           ///< over which it thins towards its edge
constexpr double kCytosolicPaxillin = 0.3;  ///< where the cell is thickest
constexpr double kSpecks_per_um2 = 0.2;     ///< nascent adhesions and vesicles, too small to count
constexpr double kDimmestFilament = 0.03;
constexpr double kThinFilament_um = 0.1;       ///< standard deviation of its cross-section
constexpr double kEdgeActin_um = 0.25;         ///< standard deviation of its cross-section
constexpr double kBulge = 0.65;                ///< part of the thickness that the lamella lacks
constexpr double kCloud_um = 4;                ///< size of the cytosol's uneven regions
constexpr double kGrain_um = 0.2;              ///< standard deviation of its dots, about the resolution of light
constexpr double kNucleusRim = 0.12;           ///< over which the nucleus's shadow begins, of its radius
constexpr double kFullWidthPerSigma = 2.3548;  ///< full width at half maximum of a Gaussian, 2 sqrt(2 ln 2)

Vec2 centroid_of(const Polygon& polygon) {
  Vec2 sum;
  for (const Vec2 p : polygon) sum += p;
  return (1.0 / static_cast<double>(polygon.size())) * sum;
}

/// Relative thickness of the cell: 1 at the nucleus, thin in the lamella, 0 outside; with clouds.
images::Image thickness_of(const Cell& cell, double bulge_share, double least, const MicroscopeParameters& m,
                           Random& random, int threads) {
  images::Image thickness = coverage_of(cell.outline_um, m.image_size_px, m.pixel_size_um);
  const images::Image wide = blurred(thickness, kLamella_um, threads);
  const images::Image clouds = smooth_noise(m.image_size_px, m.pixel_size_um, 0.8, random, threads);
  const Vec2 nucleus = centroid_of(cell.outline_um) + Vec2{2 * random.normal(), 2 * random.normal()};
  for (int row = 0; row < thickness.height; ++row) {
    for (int column = 0; column < thickness.width; ++column) {
      const Vec2 at{(column + 0.5) * m.pixel_size_um, (row + 0.5) * m.pixel_size_um};
      const double bulge =
          1 - bulge_share + bulge_share * std::exp(-0.5 * std::pow(norm(at - nucleus) / kNucleusRadius_um, 2));
      const double lamella = least + (1 - least) * std::pow(wide.at(column, row), 2);
      const double cloud = std::max(0.2, 1 + 0.12 * clouds.at(column, row));
      thickness.at(column, row) *= static_cast<float>(bulge * lamella * cloud);
    }
  }
  return thickness;
}

/// A point of the cell, anywhere.
Vec2 point_inside(const Polygon& outline, Random& random) {
  const auto [low, high] = extent_of(outline);
  while (true) {  // the outline fills more than a tenth of its box
    const Vec2 p{random.uniform(low.x, high.x), random.uniform(low.y, high.y)};
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
  for (Wave& w : waves)
    w = {2 * std::numbers::pi / (wavelength_um * random.uniform(1, 5)), random.uniform(0, 2 * std::numbers::pi)};
  return [waves, strength](double s) {
    double value = 1;
    for (const Wave& w : waves) value += strength / std::numbers::sqrt2 * std::sin(w.number_per_um * s + w.phase_rad);
    return std::max(0.1, value);
  };
}

/// The share of what is there that the nucleus hides: 1 over it, 0 beside it.
double share_over(const Nucleus& nucleus, Vec2 point) {
  return 0.5 * std::erfc((nucleus.distance(point) - 1) / (std::numbers::sqrt2 * kNucleusRim));
}

/// The point at an arc length from the start of a line with points at equal distances.
Vec2 point_at(const Polyline& line, double spacing_um, double s) {
  const double at = std::clamp(s / spacing_um, 0.0, static_cast<double>(line.size() - 1));
  const auto i = std::min(static_cast<std::size_t>(at), line.size() - 2);
  return line[i] + (at - static_cast<double>(i)) * (line[i + 1] - line[i]);
}

void add_fibre_image(images::Image& image, const Fibre& fibre, const ActinParameters& p, const Nucleus& nucleus,
                     Random& random, Random& fading) {
  constexpr double kSpacing_um = 0.5;
  const Polyline line = resampled(fibre.points_um, kSpacing_um);
  const double total = length_um(fibre.points_um), spacing = length_um(line) / static_cast<double>(line.size() - 1);
  const auto wave = modulation(p.fibre_modulation, 1.5, random);
  const auto slow = modulation(p.fibre_fading, 6, fading);
  // a free end frays: half its brightness lies at the very end
  const auto amplitude = [&](double s) {
    double value = fibre.mean_intensity * wave(s);
    if (p.fibre_fading > 0) value *= slow(s);
    if (p.fibre_brightness != 1) value *= p.fibre_brightness;
    if (p.nuclear_dimming > 0) value *= 1 - p.nuclear_dimming * share_over(nucleus, point_at(line, spacing, s));
    if (!fibre.start_adhesion_id) value *= std::min(1.0, 0.5 + s);
    if (!fibre.end_adhesion_id) value *= std::min(1.0, 0.5 + total - s);
    return value;
  };
  add_line(image, line, fibre.width_um / kFullWidthPerSigma, amplitude);
}

/// A fold of the membrane: a wavy band along the edge, a little inside.
void add_ruffle(images::Image& image, const Polygon& outline, double relative, Random& random) {
  const double length = random.uniform(4, 10), depth = random.uniform(0.3, 2), wavelength = random.uniform(1.5, 3);
  const double swing = random.uniform(0.15, 0.4), brightness = relative * random.uniform(0.5, 1.2);
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

void add_thin_filaments(images::Image& image, const Cell& cell, const ActinParameters& p, Random& random,
                        Random& bends) {
  const Vec2 centre = centroid_of(cell.outline_um);
  for (int i = 0; i < number_of(p.filaments_per_um2, cell); ++i) {
    const Vec2 start = point_inside(cell.outline_um, random);
    const Vec2 outward = start - centre;
    const double turn = random.uniform() < 0.5 ? 0.0 : 0.5 * std::numbers::pi;
    const double angle = std::atan2(outward.y, outward.x) + turn + 0.5 * random.normal();
    const double length = random.uniform(p.shortest_filament_um, p.longest_filament_um);
    const Vec2 end = start + length * direction(angle);
    const double brightness = kDimmestFilament + p.filament_brightness * std::pow(random.uniform(), 3);
    if (!contains(cell.outline_um, end)) continue;
    const Polyline line = p.filament_bend > 0 ? parabola(start, end, p.filament_bend * length * bends.normal(), 0.25)
                                              : Polyline{start, end};
    add_line(image, line, kThinFilament_um, [&](double) { return brightness; });
  }
}

/// Spikes from a little inside the edge outwards, that thin out.
void add_filopodia(images::Image& image, const Polygon& outline, const ActinParameters& p, Random& random) {
  const int n = static_cast<int>(outline.size());
  const double turn = signed_area_um2(outline) > 0 ? 1 : -1;
  for (int i = 0; i < p.n_filopodia; ++i) {
    const int at = random.below(n);
    const Vec2 along = unit(outline[(at + 2) % n] - outline[(at + n - 2) % n]);
    const double angle = std::atan2(along.y, along.x) - turn * 0.5 * std::numbers::pi + 0.35 * random.normal();
    const double root = random.uniform(0.5, 2), length = 0.7 + 3.5 * std::pow(random.uniform(), 2);
    const Vec2 start = outline[at] - root * direction(angle), end = outline[at] + length * direction(angle);
    const double brightness = p.cytosol * random.uniform(0.3, 0.9), total = root + length;
    const double bend = 0.03 * total * random.normal();
    add_line(image, parabola(start, end, bend, 0.25), kThinFilament_um, [&](double s) {
      return brightness * std::min({1.0, s / root, 0.3 + (total - s) / length});
    });
  }
}

/// Cytosol: uneven over some micrometres and over the resolution of light, darker over the nucleus.
void shade_cytosol(images::Image& image, const ActinParameters& p, const Nucleus& nucleus,
                   const MicroscopeParameters& m, Random& random, int threads) {
  if (p.clouds == 0 && p.grain == 0 && p.nuclear_shadow == 0) return;
  const images::Image clouds = smooth_noise(m.image_size_px, m.pixel_size_um, kCloud_um, random, threads);
  const images::Image grain = smooth_noise(m.image_size_px, m.pixel_size_um, kGrain_um, random, threads);
  for (int row = 0; row < image.height; ++row) {
    for (int column = 0; column < image.width; ++column) {
      const Vec2 at{(column + 0.5) * m.pixel_size_um, (row + 0.5) * m.pixel_size_um};
      const double light = std::exp(p.clouds * clouds.at(column, row) + p.grain * grain.at(column, row));
      image.at(column, row) *= static_cast<float>(light * (1 - p.nuclear_shadow * share_over(nucleus, at)));
    }
  }
}

}  // namespace

images::Image paxillin_specimen(const Cell& cell, const MicroscopeParameters& m, std::uint64_t seed, int threads) {
  Random random(seed, Stream::optics, 0);
  images::Image image = thickness_of(cell, kBulge, 0, m, random, threads);
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

double Nucleus::distance(Vec2 point) const {
  const Vec2 offset = point - centre_um;
  return std::hypot(dot(offset, long_axis) / half_length_um, cross(long_axis, offset) / half_width_um);
}

Nucleus nucleus_of(const Cell& cell, std::uint64_t seed) {
  constexpr double kNucleusRadius_um = 8;  // mean
  Random random(seed, Stream::optics, 3);
  Nucleus nucleus;
  nucleus.centre_um = centroid_of(cell.outline_um) + Vec2{2 * random.normal(), 2 * random.normal()};
  nucleus.long_axis = direction(random.uniform(0, std::numbers::pi));
  const double stretch = std::sqrt(random.uniform(1, 1.6));
  nucleus.half_length_um = kNucleusRadius_um * stretch;
  nucleus.half_width_um = kNucleusRadius_um / stretch;
  return nucleus;
}

images::Image actin_specimen(const Cell& cell, const ActinParameters& p, const MicroscopeParameters& m,
                             std::uint64_t seed, int threads) {
  // what scenarios came to have later has streams of its own, so that earlier images stay as they are
  Random random(seed, Stream::optics, 1), added(seed, Stream::optics, 4);
  const Nucleus nucleus = nucleus_of(cell, seed);
  images::Image image = thickness_of(cell, p.bulge, p.lamella, m, random, threads);
  for (float& value : image.pixels) value *= static_cast<float>(p.cytosol);
  shade_cytosol(image, p, nucleus, m, added, threads);
  add_thin_filaments(image, cell, p, random, added);
  Polyline edge = cell.outline_um;
  edge.push_back(edge.front());
  const auto ruffles = modulation(0.35, 8, random);
  add_line(image, edge, kEdgeActin_um, [&](double s) { return p.edge_brightness * ruffles(s); });
  for (const Fibre& fibre : cell.fibres) add_fibre_image(image, fibre, p, nucleus, random, added);
  for (int i = 0; i < p.n_ruffles; ++i) add_ruffle(image, cell.outline_um, p.ruffle_brightness, random);
  add_filopodia(image, cell.outline_um, p, added);
  return image;
}

}  // namespace mbtfm::drawing
