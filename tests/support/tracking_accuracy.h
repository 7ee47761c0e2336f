/// How far tracked beads are from the truth.
#pragma once

#include "segment/beads/track.h"
#include "tests/support/bead_pair.h"

namespace mbtfm::test {

/// Mean square of something, gathered over beads.
struct MeanSquare {
  double sum = 0;
  int n = 0;
  void add(double square) { sum += square, ++n; }
  double mean() const { return n > 0 ? sum / n : 0; }
  double root() const { return std::sqrt(mean()); }
  MeanSquare& operator+=(const MeanSquare& other) {
    sum += other.sum, n += other.n;
    return *this;
  }
};

/// Of the good beads, px. Errors are the lengths of vectors; variances are of error/sigma by component.
struct TrackingErrors {
  MeanSquare all, small, large;  ///< all beads; where the true displacement is < 0.5 px; where it is > 2 px
  MeanSquare ratio;              ///< measured over true along the true displacement where that is > 6 px: its mean
  MeanSquare variance, steep_variance;  ///< steep: where the true gradient exceeds 0.1
  MeanSquare drift;
  int n_beads = 0, n_good = 0;
  int n_wrong = 0;   ///< further off than 1 px
  MeanSquare steep;  ///< where the true gradient exceeds 0.1
  MeanSquare peak;   ///< of the good bead that moves most, what is found, over what any bead moves: its mean
  int n_silent = 0;  ///< wrong, and by more than five standard errors
  TrackingErrors& operator+=(const TrackingErrors& o) {
    all += o.all, small += o.small, large += o.large, ratio += o.ratio, variance += o.variance;
    steep_variance += o.steep_variance, drift += o.drift;
    n_beads += o.n_beads, n_good += o.n_good, n_wrong += o.n_wrong;
    steep += o.steep, peak += o.peak, n_silent += o.n_silent;
    return *this;
  }
};

/// Of a tracking with pixels of 1 um.
inline TrackingErrors errors_of(const beads::Tracking& tracking, const std::vector<Peak>& peaks, Vec2 drift = {}) {
  TrackingErrors e;
  e.n_beads = static_cast<int>(tracking.field.size());
  const Vec2 missed = tracking.common.drift_um - drift;
  e.drift.add(dot(missed, missed));
  double most = 0, most_good = 0, found = 0;
  for (const Bead& bead : tracking.field) {
    const Vec2 place = bead.position_um - Vec2{0.5, 0.5};
    most = std::max(most, norm(displacement(peaks, place)));
    if (!bead.flag.empty()) continue;
    ++e.n_good;
    const Vec2 truth = displacement(peaks, place), error = bead.displacement_um - truth;
    const double squared = dot(error, error), length = norm(truth);
    const double relative = 0.5 * squared / (bead.sigma_um * bead.sigma_um);
    e.all.add(squared);
    if (length < 0.5) e.small.add(squared);
    if (length > 2) e.large.add(squared);
    if (length > 6) e.ratio.add(dot(bead.displacement_um, truth) / (length * length));
    e.variance.add(relative);
    if (steepness(peaks, place) > 0.1) e.steep_variance.add(relative), e.steep.add(squared);
    if (squared > 1) ++e.n_wrong;
    if (squared > std::max(1.0, 25 * bead.sigma_um * bead.sigma_um)) ++e.n_silent;
    if (length > most_good) most_good = length, found = dot(bead.displacement_um, truth) / length;
  }
  if (most > 0) e.peak.add(found / most);
  return e;
}

inline std::string line_of(const TrackingErrors& e) {
  char text[200];
  std::snprintf(text, sizeof text, "%5.1f %%  %.3f  %.4f %.3f  %.3f  %.2f   %.2f   %.3f  %d",
                100.0 * e.n_good / std::max(1, e.n_beads), e.all.root(), e.small.root(), e.large.root(), e.ratio.mean(),
                e.variance.mean(), e.steep_variance.mean(), e.drift.root(), e.n_wrong);
  return text;
}

}  // namespace mbtfm::test
