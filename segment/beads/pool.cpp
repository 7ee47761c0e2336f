#include "segment/beads/measure.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <opencv2/core.hpp>

#include "pipeline/numerics/order_statistics.h"
#include "segment/beads/follow.h"
#include "segment/beads/local_motion.h"

namespace mbtfm::beads {
namespace {

constexpr std::size_t kFewest = 8;

/// What the neighbours of a bead say of it.
struct Prediction {
  std::vector<int> from;
  Motion motion;
  double noise_share = 0;  ///< of its variance over a neighbour's
  double reach_px = 0;
  double gradient = 0;
  double misfit = -1;  ///< mean square of a component of own minus predicted; < 0: no prediction
};

std::vector<Prediction> predictions(const Scene& scene, const std::vector<Track>& tracks, Order order) {
  const std::vector<Motion> motions = motions_of(tracks);
  std::vector<Prediction> result(tracks.size());
  const int n_neighbours = order == Order::affine ? 20 : 24;
  // nearer ones share the bead's own pixels and errors
  const double gap = 4 * scene.bead_sigma();
  for_each_bead(scene, [&](int k) {
    if (!tracks[k].is_good()) return;
    std::vector<int> from = good_around(scene, tracks, k, n_neighbours, gap);
    if (from.size() < kFewest) return;
    const auto local = local_motion(scene.position(k), from, scene.relaxed->positions, motions, order);
    const Motion& g = local->motion;
    const Vec2 misfit = motions[k].u - g.u;
    result[k] = {.from = std::move(from),
                 .motion = g,
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
/// of the beads counts around which the field changes least: elsewhere it is the field that predictions miss.
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

/// Predictions of one order, and how far they miss.
struct Predicted {
  std::vector<Prediction> beads;
  std::vector<double> missed = {};   ///< T² by bead, px²; < 0: not known
  std::vector<double> usually = {};  ///< by the median of the beads around, which a false one among them does not move
};

/// How far predictions around a bead miss, beyond the errors of what they are compared with.
void find_missed(const Scene& scene, const std::vector<double>& own_variance, Predicted& predicted) {
  const std::vector<Prediction>& beads = predicted.beads;
  predicted.missed.assign(beads.size(), -1);
  predicted.usually.assign(beads.size(), -1);
  for_each_bead(scene, [&](int k) {
    if (beads[k].misfit < 0) return;
    std::vector<double> beyond;
    beyond.reserve(beads[k].from.size());
    double sum = 0, variance = 0;
    for (const int j : beads[k].from) {
      if (beads[j].misfit < 0) continue;
      const double own = (1 + beads[j].noise_share) * own_variance[j];
      beyond.push_back(beads[j].misfit / std::numbers::ln2 - own);
      sum += beads[j].misfit - own;
      variance += own_variance[j];
    }
    if (beyond.size() < kFewest) return;
    const double n = static_cast<double>(beyond.size()), noise = beads[k].noise_share * variance / n;
    predicted.missed[k] = noise + std::max(0.0, sum / n);
    predicted.usually[k] = noise + std::max(0.0, numerics::quantile(std::move(beyond), 0.5));
  });
}

struct BothOrders {
  Predicted affine, curved;
  /// The affine one, of nearer beads, unless the curved one misses by half as much: T² of twenty is known to a third.
  const Predicted& of(int k) const {
    const double a = affine.missed[k], b = curved.missed[k];
    return a >= 0 && (b < 0 || a <= 2 * b) ? affine : curved;
  }
  void find_missed(const Scene& scene, const std::vector<double>& own_variance) {
    beads::find_missed(scene, own_variance, affine);
    beads::find_missed(scene, own_variance, curved);
  }
};

/// A lone bead keeps its shape, crowded ones are strained as the gel is. Whether the gel is strained, and the light did
/// neither, both by two standard deviations of what the registration expects: then the gel drew two beads apart that
/// one of the images shows as one.
bool is_torn(const Scene& scene, const Motion& own, const Motion& gel) {
  const cv::Vec4d g(own.ux_x, own.ux_y, own.uy_x, own.uy_y), strain(gel.ux_x, gel.ux_y, gel.uy_x, gel.uy_y);
  const double share = std::clamp(g.dot(strain) / std::max(strain.dot(strain), 1e-12), 0.0, 1.0);
  return std::min(cv::norm(strain), cv::norm(g - share * strain)) > 2 * scene.narrow.gradient_sd;
}

constexpr double kContradicted = 8;  // of misfit² over variance, of a component: four standard deviations

/// Flags beads that their neighbours contradict if they are torn, or if nothing pulls them: others know better.
/// @return how many
int flag_false(const Scene& scene, double threshold, const BothOrders& predicted,
               const std::vector<double>& own_variance, double scatter_px, std::vector<Track>& tracks) {
  std::vector<char> is_contradicted(tracks.size(), 0);
  int n_torn = 0;
  for (int k = 0; k < scene.n_beads(); ++k) {
    const Predicted& p = predicted.of(k);
    if (p.missed[k] < 0 || p.beads[k].misfit <= kContradicted * (own_variance[k] + p.usually[k])) continue;
    is_contradicted[k] = 1;
    if (!is_torn(scene, tracks[k].found.motion, p.beads[k].motion)) continue;
    tracks[k].flag = TrackFlag::neighbours_disagree;
    ++n_torn;
  }
  return n_torn + flag_unpulled(scene, threshold, is_contradicted, scatter_px, tracks);
}

}  // namespace

Pooling pooled(const Scene& scene, double threshold, std::vector<Track>& tracks) {
  BothOrders predicted{{predictions(scene, tracks, Order::affine)}, {predictions(scene, tracks, Order::curved)}};
  const ErrorCheck errors = check_errors(predicted.curved.beads, tracks);
  const double loose = errors.scatter * errors.scatter;
  std::vector<double> own_variance;
  for (const Track& track : tracks) own_variance.push_back(errors.scale * std::pow(track.found.sigma_px, 2) + loose);
  predicted.find_missed(scene, own_variance);
  if (flag_false(scene, threshold, predicted, own_variance, errors.scatter, tracks) > 0) {
    for (std::size_t k = 0; k < tracks.size(); ++k) {
      if (!tracks[k].is_good()) predicted.affine.beads[k].misfit = predicted.curved.beads[k].misfit = -1;
    }
    predicted.find_missed(scene, own_variance);
  }
  Pooling result;
  result.scatter_px = errors.scatter;
  result.beads.resize(tracks.size());
  for_each_bead(scene, [&](int k) {
    result.beads[k] = {tracks[k].found.motion.u, std::sqrt(own_variance[k])};
    const Prediction& here = predicted.of(k).beads[k];
    const double missed = predicted.of(k).missed[k], missed_by_affine = predicted.affine.missed[k];
    if (missed < 0 || !(own_variance[k] > 0)) return;
    double own = own_variance[k] - loose;
    if (missed_by_affine >= 0) {
      // What an affine motion misses grows with the square of the distance: the share of it that the window sees
      const double within = 2 * scene.narrow.sigma / predicted.affine.beads[k].reach_px;  // weights fall to 1/e² there
      own += std::pow(within, 4) * missed_by_affine;
    }
    result.beads[k].sigma_px = std::sqrt(own + loose);
    // Three standard deviations would leave one in ninety for noise alone to its own error, and a third of all the
    // error is theirs.
    if (!(own > 0) || here.misfit > kContradicted * (own + loose + missed)) return;
    constexpr double kFineEnough = 0.02;  // px
    const double weight = std::min(1 / (missed + loose), std::max(0.0, 1 / (kFineEnough * kFineEnough) - 1 / own));
    const double share = 1 / (1 + own * weight);  // of the bead's own measurement
    const double variance_of_mean = share * share * (own + loose) + (1 - share) * (1 - share) * missed;
    result.beads[k] = {share * tracks[k].found.motion.u + (1 - share) * here.motion.u, std::sqrt(variance_of_mean)};
  });
  return result;
}

}  // namespace mbtfm::beads
