#include "segment/beads/measure.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/numerics/order_statistics.h"
#include "segment/beads/local_motion.h"

namespace mbtfm::beads {
namespace {

constexpr int kNeighbours = 20;
constexpr std::size_t kFewest = 8;

/// What the neighbours of a bead say of it.
struct Prediction {
  std::vector<int> from;
  Vec2 u;
  double noise_share = 0;  ///< of its variance over a neighbour's
  double reach_px = 0;
  double gradient = 0;
  double misfit = -1;  ///< mean square of a component of own minus predicted; < 0: no prediction
};

std::vector<Prediction> predictions(const Scene& scene, const std::vector<Track>& tracks) {
  const std::vector<Motion> motions = motions_of(tracks);
  std::vector<Prediction> result(tracks.size());
  // nearer ones share the bead's own pixels and errors
  const double gap = 4 * scene.bead_sigma();
  for_each_bead(scene, [&](int k) {
    if (!tracks[k].is_good()) return;
    std::vector<int> from = good_around(scene, tracks, k, kNeighbours, gap);
    if (from.size() < kFewest) return;
    const auto local = local_motion(scene.position(k), from, scene.relaxed->positions, motions);
    const Motion& g = local->motion;
    const Vec2 misfit = motions[k].u - g.u;
    result[k] = {.from = std::move(from),
                 .u = g.u,
                 .noise_share = local->noise_share,
                 .reach_px = local->reach_px,
                 .gradient = std::hypot(g.ux_x, g.ux_y, std::hypot(g.uy_x, g.uy_y)),
                 .misfit = 0.5 * dot(misfit, misfit)};
  });
  return result;
}

struct ErrorCheck {
  double scale = 1;    ///< of the registrations' variances
  double scatter = 0;  ///< px, beyond them
};

/// Compare the registrations' standard errors with what the neighbours see of them: the median of misfit² / variance
/// must be that of a two-dimensional normal variable, ln 2 of a component's mean square. A registration may be wrong
/// about its own variance by half of it, to either side; what is beyond that is scatter of single beads. Only the half
/// of the beads counts around which the field changes least: elsewhere it is the field that affine predictions miss.
ErrorCheck check_errors(const std::vector<Prediction>& predicted, const std::vector<Track>& tracks) {
  std::vector<double> gradients;
  for (const Prediction& p : predicted) {
    if (p.misfit >= 0) gradients.push_back(p.gradient);
  }
  const double calm = numerics::quantile(std::move(gradients), 0.5);
  ErrorCheck result;
  const auto median_ratio = [&](double scatter) {
    std::vector<double> ratios;
    for (std::size_t k = 0; k < tracks.size(); ++k) {
      const double own = result.scale * tracks[k].found.sigma_px * tracks[k].found.sigma_px;
      const double variance = (1 + predicted[k].noise_share) * (own + scatter * scatter);
      if (predicted[k].misfit < 0 || predicted[k].gradient > calm || !(variance > 0)) continue;
      ratios.push_back(predicted[k].misfit / variance);
    }
    return numerics::quantile(std::move(ratios), 0.5) / std::numbers::ln2;
  };
  result.scale = std::clamp(median_ratio(0), 0.5, 1.5);
  if (median_ratio(0) <= 1) return result;
  double low = 0, high = 10;
  for (int step = 0; step < 20; ++step) {
    const double middle = 0.5 * (low + high);
    (median_ratio(middle) > 1 ? low : high) = middle;
  }
  result.scatter = high;
  return result;
}

}  // namespace

Pooling pooled(const Scene& scene, const std::vector<Track>& tracks) {
  const std::vector<Prediction> predicted = predictions(scene, tracks);
  Pooling result;
  const ErrorCheck errors = check_errors(predicted, tracks);
  result.scatter_px = errors.scatter;
  result.beads.resize(tracks.size());
  const double loose = errors.scatter * errors.scatter;
  const auto own_variance = [&](std::size_t k) {
    return errors.scale * tracks[k].found.sigma_px * tracks[k].found.sigma_px + loose;
  };
  for_each_bead(scene, [&](int k) {
    const Prediction& here = predicted[k];
    result.beads[k] = {tracks[k].found.motion.u, std::sqrt(own_variance(k))};
    if (here.misfit < 0 || !(own_variance(k) > 0)) return;
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
    // What an affine motion misses grows with the square of the distance: the share of it that the window sees
    const double within = 2 * scene.narrow.sigma / here.reach_px;  // weights fall to 1/e² at the reach
    const double own = own_variance(k) - loose + std::pow(within, 4) * missed;
    result.beads[k].sigma_px = std::sqrt(own + loose);
    // Beyond four standard deviations the bead knows better. Three would leave one in ninety for noise alone to its own
    // error, and a third of all the error is theirs.
    if (!(own > 0) || here.misfit > 8 * (own + loose + missed)) return;
    constexpr double kFineEnough = 0.02;  // px
    const double weight = std::min(1 / (missed + loose), std::max(0.0, 1 / (kFineEnough * kFineEnough) - 1 / own));
    const double share = 1 / (1 + own * weight);  // of the bead's own measurement
    const double variance_of_mean = share * share * (own + loose) + (1 - share) * (1 - share) * missed;
    result.beads[k] = {share * tracks[k].found.motion.u + (1 - share) * here.u, std::sqrt(variance_of_mean)};
  });
  return result;
}

}  // namespace mbtfm::beads
