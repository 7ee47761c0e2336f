#include "samples/drawing/psf.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "pipeline/numerics/parallel.h"

namespace mbtfm::drawing {
namespace {

constexpr double kStep_um = 0.05;  // of the table, a sixth of what the finest lens here resolves
constexpr int kDepths = 9;         // a phase that grows with depth changes the picture by little between two
constexpr int kAcross = static_cast<int>(PointSpread::kReach_um / kStep_um + 0.5) + 1;
constexpr int kHalfAlong = static_cast<int>(PointSpread::kReachAlongZ_um / kStep_um + 0.5);
constexpr int kAlong = 2 * kHalfAlong + 1;

/// A field of rotational symmetry on the table's lattice.
struct Field {
  int n_r, half_z;
  std::vector<double> values;
  double& at(int r, int z) { return values[static_cast<std::size_t>(z + half_z) * n_r + r]; }
  double at(int r, int z) const { return values[static_cast<std::size_t>(z + half_z) * n_r + r]; }
  /// Linear between the lattice's places, 0 beyond.
  double between(double r, double z) const {
    const double x = r / kStep_um, y = z / kStep_um + half_z;
    const int i = static_cast<int>(x), j = static_cast<int>(std::floor(y));
    if (i + 1 >= n_r || j < 0 || j >= 2 * half_z) return 0;
    const double a = x - i, b = y - j;
    const double* v = values.data() + static_cast<std::size_t>(j) * n_r + i;
    return (1 - b) * ((1 - a) * v[0] + a * v[1]) + b * ((1 - a) * v[n_r] + a * v[n_r + 1]);
  }
};

/// |∫ … ρ dρ|² by the midpoint rule: 300 points follow the phase of 5 um out of focus at 100 um depth.
Field intensity(const Optics& o, double wavelength_um, double depth_um, int n_r, int half_z) {
  constexpr int kPupil = 300;
  const double k = 2 * std::numbers::pi / wavelength_um;
  std::vector<double> share(kPupil), along(kPupil), aberration(kPupil), bessel(static_cast<std::size_t>(n_r) * kPupil);
  for (int p = 0; p < kPupil; ++p) {
    const double rho = (p + 0.5) / kPupil, sine = o.numerical_aperture * rho;
    share[p] = rho / kPupil;
    along[p] = k * std::sqrt(o.gel_index * o.gel_index - sine * sine);
    aberration[p] = depth_um * (along[p] - k * std::sqrt(o.immersion_index * o.immersion_index - sine * sine));
    for (int r = 0; r < n_r; ++r)
      bessel[static_cast<std::size_t>(r) * kPupil + p] = share[p] * std::cyl_bessel_j(0, k * sine * kStep_um * r);
  }
  // the paraxial shift and the phase of the middle change nothing but the place of the brightest plane
  Field field{n_r, half_z, std::vector<double>(static_cast<std::size_t>(n_r) * (2 * half_z + 1))};
  std::vector<double> real(kPupil), imaginary(kPupil);
  for (int z = -half_z; z <= half_z; ++z) {
    for (int p = 0; p < kPupil; ++p) {
      const double phase = (kStep_um * z) * along[p] + aberration[p];
      real[p] = std::cos(phase), imaginary[p] = std::sin(phase);
    }
    for (int r = 0; r < n_r; ++r) {
      const double* j = bessel.data() + static_cast<std::size_t>(r) * kPupil;
      double a = 0, b = 0;
      for (int p = 0; p < kPupil; ++p) a += j[p] * real[p], b += j[p] * imaginary[p];
      field.at(r, z) = 4 * (a * a + b * b);  // 1 in focus
    }
  }
  return field;
}

/// Where the focus lies by the rays near the axis: a bead at depth d is in focus when z = d (n_i/n - 1) …
double paraxial_shift_um(const Optics& o, double depth_um) { return depth_um * (o.gel_index / o.immersion_index - 1); }

/// Points spread over the bead's volume and the pixel's face (R3 sequence of the plastic number, Roberts 2018).
std::vector<std::array<double, 3>> smear(const Optics& o, double pixel_um) {
  constexpr int kPoints = 250;
  std::vector<std::array<double, 3>> points;
  double u[5] = {0.5, 0.5, 0.5, 0.5, 0.5};
  const double steps[5] = {0.8566748838545029, 0.7338918566271260, 0.6287067210378087, 0.5385972572236101,
                           0.4614018718506150};
  while (points.size() < kPoints) {
    for (int a = 0; a < 5; ++a) u[a] = std::fmod(u[a] + steps[a], 1.0);
    const double x = 2 * u[0] - 1, y = 2 * u[1] - 1, z = 2 * u[2] - 1;
    if (x * x + y * y + z * z > 1) continue;
    const double radius = 0.5 * o.bead_diameter_um;
    points.push_back({radius * x + pixel_um * (u[3] - 0.5), radius * y + pixel_um * (u[4] - 0.5), radius * z});
  }
  return points;
}

}  // namespace

PointSpread::PointSpread(const Optics& optics, double deepest_um, double pixel_um, int threads)
    : deepest_um_(std::max(deepest_um, 1e-6)) {
  const auto points = smear(optics, pixel_um);
  const auto margin = static_cast<int>((0.5 * optics.bead_diameter_um + pixel_um) / kStep_um) + 2;
  table_.resize(static_cast<std::size_t>(kDepths) * kAlong * kAcross);
  numerics::parallel_for(kDepths, threads, [&](int d) {
    const double depth_um = deepest_um_ * d / (kDepths - 1);
    // the table is wide enough to hold the brightest plane, which aberration moves from the paraxial one
    const auto away = static_cast<int>(2 * std::abs(paraxial_shift_um(optics, depth_um)) / kStep_um) + 20;
    const int n_r = kAcross + margin + 1, half_z = kHalfAlong + margin + away;
    Field light = intensity(optics, optics.excitation_um, depth_um, n_r, half_z);
    const Field detected = intensity(optics, optics.emission_um, depth_um, n_r, half_z);
    for (std::size_t k = 0; k < light.values.size(); ++k) light.values[k] *= detected.values[k];
    int brightest = 0;
    for (int z = -half_z; z <= half_z; ++z)
      if (light.at(0, z) > light.at(0, brightest)) brightest = z;
    for (int z = -kHalfAlong; z <= kHalfAlong; ++z) {
      for (int r = 0; r < kAcross; ++r) {
        double sum = 0;
        for (const auto& p : points)
          sum += light.between(std::hypot(kStep_um * r - p[0], p[1]), kStep_um * (z + brightest) - p[2]);
        table_[(static_cast<std::size_t>(d) * kAlong + static_cast<std::size_t>(z + kHalfAlong)) * kAcross +
               static_cast<std::size_t>(r)] = static_cast<float>(sum / static_cast<double>(points.size()));
      }
    }
  });
  float largest = 0;
  for (int z = 0; z < kAlong; ++z) largest = std::max(largest, table_[static_cast<std::size_t>(z) * kAcross]);
  for (float& value : table_) value /= largest;
}

double PointSpread::at(double r_um, double z_um, double depth_um) const {
  const double x = r_um / kStep_um, y = z_um / kStep_um + kHalfAlong;
  const double w = std::clamp(depth_um / deepest_um_, 0.0, 1.0) * (kDepths - 1);
  const int i = static_cast<int>(x), j = static_cast<int>(std::floor(y)),
            d = std::min(static_cast<int>(w), kDepths - 2);
  if (i + 1 >= kAcross || j < 0 || j + 1 >= kAlong) return 0;
  const auto a = static_cast<float>(x - i), b = static_cast<float>(y - j), c = static_cast<float>(w - d);
  const auto plane = [&](int depth) {
    const float* v = table_.data() +
                     (static_cast<std::size_t>(depth) * kAlong + static_cast<std::size_t>(j)) * kAcross +
                     static_cast<std::size_t>(i);
    return (1 - b) * ((1 - a) * v[0] + a * v[1]) + b * ((1 - a) * v[kAcross] + a * v[kAcross + 1]);
  };
  return (1 - c) * plane(d) + c * plane(d + 1);
}

}  // namespace mbtfm::drawing
