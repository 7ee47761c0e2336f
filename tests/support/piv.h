/// Image correlation in windows, for comparison.
#pragma once

#include "segment/beads/coarse_field.h"
#include "segment/beads/track.h"
#include "tests/support/bead_pair.h"

namespace mbtfm::test {

/// A bead of an image pair, px.
struct Moved {
  Vec2 place, u;
};

/// A published grid's place less the middle of its window: PIVlab counts pixels from 1, and a window of an even number
/// of them begins half its side before its place.
constexpr double kPivOrigin_px = 1.5;

/// Where a published PIV has its vectors: rows of a square grid, one after the other.
struct PivGrid {
  std::vector<Vec2> middles;  ///< of its windows, px, 0 at the centre of the first pixel
  beads::GridField field(std::vector<Vec2> u) const {
    const auto in_first_row = [&](Vec2 p) { return p.y == middles[0].y; };
    beads::GridField grid;
    grid.nx = static_cast<int>(std::count_if(middles.begin(), middles.end(), in_first_row));
    grid.ny = static_cast<int>(middles.size()) / grid.nx;
    grid.spacing = middles[1].x - middles[0].x;
    grid.first = middles[0];
    grid.u = std::move(u);
    return grid;
  }
};

/// Weighed 1 : 2 : 1 with the neighbours along both axes.
inline beads::GridField smoothed(const beads::GridField& field) {
  beads::GridField result = field;
  for (int j = 0; j < field.ny; ++j)
    for (int i = 0; i < field.nx; ++i) {
      Vec2 sum;
      for (int b = -1; b <= 1; ++b)
        for (int a = -1; a <= 1; ++a) {
          const int x = std::clamp(i + a, 0, field.nx - 1), y = std::clamp(j + b, 0, field.ny - 1);
          sum += (2.0 - std::abs(a)) * (2.0 - std::abs(b)) / 16 * field.u[static_cast<std::size_t>(y) * field.nx + x];
        }
      result.u[static_cast<std::size_t>(j) * field.nx + i] = sum;
    }
  return result;
}

/// Of a tracking with pixels of 1 um: its good beads, drift included.
inline std::vector<Moved> moved_beads(const beads::Tracking& tracking) {
  std::vector<Moved> result;
  for (const Bead& bead : tracking.field) {
    if (!bead.flag.empty()) continue;
    result.push_back({bead.position_um - Vec2{0.5, 0.5}, bead.displacement_um + tracking.common.drift_um});
  }
  return result;
}

/// The beads of the relaxed image, moved as tracked, on the image's own background, with its noise: what image
/// correlation makes of it is what it would see of the tracked field, bright beads before dim ones.
inline BeadPair redrawn(const images::Image& relaxed, const beads::Tracking& tracking) {
  const auto beads = beads::detect_beads(relaxed);
  BeadPair pair;
  std::vector<float> sorted = relaxed.pixels;
  std::nth_element(sorted.begin(), sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() / 4), sorted.end());
  const float background = sorted[sorted.size() / 4];
  for (images::Image* image : {&pair.relaxed, &pair.stressed}) {
    *image = relaxed;
    std::fill(image->pixels.begin(), image->pixels.end(), background);
  }
  const std::vector<Moved> moved = moved_beads(tracking);
  for (const beads::DetectedBead& bead : beads) {
    const auto nearest = std::min_element(moved.begin(), moved.end(), [&](const auto& a, const auto& b) {
      return norm(a.place - bead.position_px) < norm(b.place - bead.position_px);
    });
    add_bead(pair.relaxed, bead.position_px, bead.brightness, tracking.bead_sigma_um);
    add_bead(pair.stressed, bead.position_px + nearest->u, bead.brightness, tracking.bead_sigma_um);
    pair.positions.push_back(bead.position_px);
    pair.displacements.push_back(nearest->u);
  }
  std::mt19937_64 random(101);
  std::normal_distribution<float> noise(0, 0.02f * background);
  for (images::Image* image : {&pair.relaxed, &pair.stressed})
    for (float& value : image->pixels) value += noise(random);
  return pair;
}

/// A square of an image less its mean; beyond the border it is blank.
inline std::vector<double> window_of(const images::Image& image, int left, int top, int side) {
  std::vector<double> values(static_cast<std::size_t>(side) * side, 0);
  double sum = 0;
  int n = 0;
  const auto for_each = [&](const auto& body) {
    for (int j = std::max(0, -top); j < std::min(side, image.height - top); ++j)
      for (int i = std::max(0, -left); i < std::min(side, image.width - left); ++i)
        body(values[static_cast<std::size_t>(j) * side + i], image.at(left + i, top + j));
  };
  for_each([&](double&, double pixel) { sum += pixel, ++n; });
  for_each([&](double& value, double pixel) { value = pixel - sum / n; });
  return values;
}

/// Highest correlation of two windows, shifted by up to 8 px in a circle as by Fourier transforms, with a Gaussian
/// through the peak's neighbours.
inline Vec2 piv_displacement(const images::Image& relaxed, const images::Image& stressed, Vec2 middle, int side) {
  constexpr int kReach = 8;
  const int left = static_cast<int>(std::lround(middle.x + 0.5)) - side / 2;
  const int top = static_cast<int>(std::lround(middle.y + 0.5)) - side / 2;
  const std::vector<double> p = window_of(relaxed, left, top, side), q = window_of(stressed, left, top, side);
  const auto correlation = [&](int a, int b) {
    double sum = 0;
    for (int j = 0; j < side; ++j) {
      const double* here = p.data() + static_cast<std::size_t>(j) * side;
      const double* there = q.data() + static_cast<std::size_t>((j + b + side) % side) * side;
      const int split = std::clamp(a > 0 ? side - a : -a, 0, side);
      for (int i = 0; i < split; ++i) sum += here[i] * there[i + a + (a < 0 ? side : 0)];
      for (int i = split; i < side; ++i) sum += here[i] * there[i + a - (a > 0 ? side : 0)];
    }
    return sum;
  };
  constexpr int kSide = 2 * kReach + 3;
  std::vector<double> map;
  for (int b = -kReach - 1; b <= kReach + 1; ++b)
    for (int a = -kReach - 1; a <= kReach + 1; ++a) map.push_back(correlation(a, b));
  const double lowest = *std::min_element(map.begin(), map.end());
  const auto at = [&](int a, int b) { return map[(b + kReach + 1) * kSide + a + kReach + 1]; };
  double best = -1e300;
  int a = 0, b = 0;
  for (int j = -kReach; j <= kReach; ++j)
    for (int i = -kReach; i <= kReach; ++i)
      if (at(i, j) > best) best = at(i, j), a = i, b = j;
  const auto vertex = [&](double before, double here, double after) {
    const auto log_of = [&](double value) { return std::log(std::max(value - lowest, 1e-9)); };
    const double curvature = log_of(before) - 2 * log_of(here) + log_of(after);
    return curvature < 0 ? 0.5 * (log_of(before) - log_of(after)) / curvature : 0.0;
  };
  return {a + vertex(at(a - 1, b), best, at(a + 1, b)), b + vertex(at(a, b - 1), best, at(a, b + 1))};
}

/// image(x + u(x)), by its cubic spline.
inline images::Image deformed_back(const images::Image& image, const beads::GridField& u) {
  const beads::Spline spline = beads::spline_through({image.width, image.height, image.pixels}, 1);
  images::Image result = image;
  for (int j = 0; j < image.height; ++j)
    for (int i = 0; i < image.width; ++i) {
      const Vec2 place{1.0 * i, 1.0 * j};
      result.pixels[static_cast<std::size_t>(j) * image.width + i] = beads::value_at(spline, place + u.at(place).u);
    }
  return result;
}

/// Image correlation as PIV programs do it by default (PIVlab: Thielicke & Stamhuis, J Open Res Softw 2:e30, 2014):
/// first in windows of 2 `side`, then, that smoothed, in windows of `side` of the image deformed back by it.
inline std::vector<Vec2> piv_in_two_passes(const images::Image& relaxed, const images::Image& stressed,
                                           const PivGrid& grid, int side) {
  const auto correlated = [&](const images::Image& moved, int window) {
    std::vector<Vec2> u;
    for (const Vec2 middle : grid.middles) u.push_back(piv_displacement(relaxed, moved, middle, window));
    return u;
  };
  const beads::GridField first = smoothed(grid.field(correlated(stressed, 2 * side)));
  std::vector<Vec2> u = correlated(deformed_back(stressed, first), side);
  for (std::size_t k = 0; k < u.size(); ++k) u[k] = u[k] + first.u[k];
  return u;
}

struct Agreement {
  double median_px = 0, correlation = 0;
};

inline Agreement agreement(const std::vector<Vec2>& ours, const std::vector<Vec2>& theirs) {
  std::vector<double> apart;
  Vec2 our_mean, their_mean;
  const double share = 1.0 / static_cast<double>(ours.size());
  for (std::size_t k = 0; k < ours.size(); ++k) {
    apart.push_back(norm(ours[k] - theirs[k]));
    our_mean += share * ours[k];
    their_mean += share * theirs[k];
  }
  double both = 0, our = 0, their = 0;
  for (std::size_t k = 0; k < ours.size(); ++k) {
    const Vec2 a = ours[k] - our_mean, b = theirs[k] - their_mean;
    both += dot(a, b), our += dot(a, a), their += dot(b, b);
  }
  const auto middle = apart.begin() + static_cast<std::ptrdiff_t>(apart.size() / 2);
  std::nth_element(apart.begin(), middle, apart.end());
  return {*middle, both / std::sqrt(our * their)};
}

}  // namespace mbtfm::test
