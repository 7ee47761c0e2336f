/// Image correlation in windows, for comparison: what it does itself, and what it would make of tracked beads.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "segment/track.h"

namespace mbtfm::test {

/// A bead of an image pair, px.
struct Moved {
  Vec2 place, u;
};

/// Share of a Gaussian picture at `apart` from the middle of a stretch that lies in it.
inline double share_within(double apart, double half, double sigma) {
  const double scale = 1 / (std::sqrt(2.0) * sigma);
  return 0.5 * (std::erf(scale * (apart + half)) - std::erf(scale * (apart - half)));
}

/// Image correlation in a square window of `side` px sees what most of its beads do: the mode of their displacements,
/// each with the share of its picture that the window holds, as wide as the correlation of two beads.
inline Vec2 as_correlation_sees(const std::vector<Moved>& beads, Vec2 place, double bead_sigma_px, int side = 32) {
  const Vec2 middle = place - Vec2{0.5, 0.5};  // of an even number of pixels, those before the place's own come first
  std::vector<double> shares;
  for (const Moved& bead : beads) {
    const Vec2 d = bead.place - middle;
    shares.push_back(share_within(d.x, 0.5 * side, bead_sigma_px) * share_within(d.y, 0.5 * side, bead_sigma_px));
  }
  Vec2 mode;
  for (int step = 0; step < 30; ++step) {
    const double width = step < 3 ? 4 : std::sqrt(2.0) * bead_sigma_px;
    double weights = 0;
    Vec2 sum;
    for (std::size_t k = 0; k < beads.size(); ++k) {
      if (shares[k] < 1e-6) continue;
      const Vec2 apart = beads[k].u - mode;
      const double weight = shares[k] * std::exp(-dot(apart, apart) / (2 * width * width));
      weights += weight;
      sum += weight * beads[k].u;
    }
    mode = (1 / weights) * sum;
  }
  return mode;
}

/// Of a tracking with pixels of 1 um: its good beads, drift included.
inline std::vector<Moved> moved_beads(const segment::Tracking& tracking) {
  std::vector<Moved> result;
  for (const Bead& bead : tracking.field) {
    if (!bead.flag.empty()) continue;
    result.push_back({bead.position_um - Vec2{0.5, 0.5}, bead.displacement_um + tracking.drift_um});
  }
  return result;
}

/// Correlation coefficient of a square of `side` px around a place in one image with that moved by (a, b) in the other;
/// -1 where it leaves the picture.
inline double window_correlation(const segment::Image& relaxed, const segment::Image& stressed, int x, int y, int a,
                                 int b, int side) {
  const int half = side / 2;
  const auto holds = [&](int i, int j) {
    return i >= half && j >= half && i + half <= relaxed.width && j + half <= relaxed.height;
  };
  if (!holds(x, y) || !holds(x + a, y + b)) return -1;
  double n = 0, r = 0, s = 0, rr = 0, ss = 0, rs = 0;
  for (int j = y - half; j < y + half; ++j) {
    for (int i = x - half; i < x + half; ++i) {
      const double p = relaxed.at(i, j), q = stressed.at(i + a, j + b);
      n += 1, r += p, s += q, rr += p * p, ss += q * q, rs += p * q;
    }
  }
  const double variances = (rr - r * r / n) * (ss - s * s / n);
  return variances > 0 ? (rs - r * s / n) / std::sqrt(variances) : -1;
}

/// Template matching in a window of `side` px, up to 8 px from `about`, with a Gaussian through the peak's neighbours.
inline Vec2 piv_displacement(const segment::Image& relaxed, const segment::Image& stressed, Vec2 place, Vec2 about,
                             int side) {
  constexpr int kReach = 8;
  const int x = static_cast<int>(place.x), y = static_cast<int>(place.y);
  const auto at = [&](int a, int b) { return window_correlation(relaxed, stressed, x, y, a, b, side); };
  const int a0 = static_cast<int>(std::lround(about.x)), b0 = static_cast<int>(std::lround(about.y));
  double best = -2;
  int a = a0, b = b0;
  for (int j = b0 - kReach; j <= b0 + kReach; ++j) {
    for (int i = a0 - kReach; i <= a0 + kReach; ++i) {
      const double value = at(i, j);
      if (value > best) best = value, a = i, b = j;
    }
  }
  const auto vertex = [](double before, double here, double after) {
    const auto log_of = [](double value) { return std::log(std::max(value, 1e-3)); };
    const double curvature = log_of(before) - 2 * log_of(here) + log_of(after);
    return curvature < 0 ? 0.5 * (log_of(before) - log_of(after)) / curvature : 0.0;
  };
  return {a + vertex(at(a - 1, b), best, at(a + 1, b)), b + vertex(at(a, b - 1), best, at(a, b + 1))};
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
