#include "segment/pool.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "segment/local_motion.h"

namespace mbtfm::segment {
namespace {

constexpr int kNeighbours = 20;
constexpr std::size_t kFewest = 8;

/// What the neighbours of a bead say of it.
struct Prediction {
  std::vector<int> from;
  Vec2 u;
  double noise_share = 0;  ///< of its variance over a neighbour's
  double misfit = -1;      ///< mean square of a component of own minus predicted; < 0: no prediction
};

std::vector<Prediction> predictions(const Scene& scene, const std::vector<Track>& tracks) {
  const std::vector<Motion> motions = motions_of(tracks);
  std::vector<Prediction> result(tracks.size());
  // nearer ones share the bead's own pixels and errors
  const double gap = 2.5 * scene.bead_sigma();
  for_each_bead(scene, [&](int k) {
    if (!tracks[k].is_good()) return;
    std::vector<int> from = good_around(scene, tracks, k, kNeighbours, gap);
    if (from.size() < kFewest) return;
    const auto local = local_motion(scene.position(k), from, scene.relaxed->positions, motions);
    const Vec2 misfit = motions[k].u - local->motion.u;
    result[k] = {.from = std::move(from),
                 .u = local->motion.u,
                 .noise_share = local->noise_share,
                 .misfit = 0.5 * dot(misfit, misfit)};
  });
  return result;
}

/// The s for which the median of misfit² / (sigma² + s²) is that of a two-dimensional normal variable, ln 2 of a
/// component's mean square.
double scatter_of(const std::vector<Prediction>& predicted, const std::vector<Track>& tracks) {
  const auto median_ratio = [&](double scatter) {
    std::vector<double> ratios;
    for (std::size_t k = 0; k < tracks.size(); ++k) {
      const double variance = tracks[k].found.sigma_px * tracks[k].found.sigma_px + scatter * scatter;
      if (predicted[k].misfit < 0 || !(variance > 0)) continue;
      ratios.push_back(predicted[k].misfit / ((1 + predicted[k].noise_share) * variance));
    }
    return quantile(std::move(ratios), 0.5);
  };
  double low = 0, high = 10;
  if (median_ratio(low) <= std::numbers::ln2) return 0;
  for (int step = 0; step < 20; ++step) {
    const double middle = 0.5 * (low + high);
    (median_ratio(middle) > std::numbers::ln2 ? low : high) = middle;
  }
  return high;
}

}  // namespace

Pooling pooled(const Scene& scene, const std::vector<Track>& tracks) {
  const std::vector<Prediction> predicted = predictions(scene, tracks);
  Pooling result;
  result.scatter_px = scatter_of(predicted, tracks);
  result.beads.resize(tracks.size());
  const auto own_variance = [&](std::size_t k) {
    return tracks[k].found.sigma_px * tracks[k].found.sigma_px + result.scatter_px * result.scatter_px;
  };
  for_each_bead(scene, [&](int k) {
    const Prediction& here = predicted[k];
    const double own = own_variance(k);
    result.beads[k] = {tracks[k].found.motion.u, std::sqrt(own)};
    if (here.misfit < 0 || !(own > 0)) return;
    double beyond = 0, variance = 0;
    int n = 0;
    for (const int j : here.from) {
      if (predicted[j].misfit < 0) continue;
      beyond += predicted[j].misfit - (1 + predicted[j].noise_share) * own_variance(j);
      variance += own_variance(j);
      ++n;
    }
    if (n < static_cast<int>(kFewest)) return;
    const double missed = here.noise_share * variance / n + std::max(0.0, beyond / n);
    if (here.misfit > 4.5 * (own + missed)) return;  // three standard deviations: the bead knows better
    constexpr double kFineEnough = 0.02;             // px
    const double weight = std::min(1 / missed, std::max(0.0, 1 / (kFineEnough * kFineEnough) - 1 / own));
    const double total = 1 / own + weight;
    result.beads[k] = {(1 / (own * total)) * tracks[k].found.motion.u + (weight / total) * here.u,
                       std::sqrt(1 / own + weight * weight * missed) / total};
  });
  return result;
}

}  // namespace mbtfm::segment
