#include <algorithm>
#include <cmath>
#include <opencv2/core.hpp>

#include "pipeline/numerics/order_statistics.h"
#include "segment/beads/measure.h"

namespace mbtfm::beads {
namespace {

/// Of a spot with a ghost beside it.
struct Pair {
  double height = 0, ghost = 0;
  double information = 0;  ///< 1 over the ghost's variance, for noise of 1
};

/// Least squares over the pixels near both places, by a constant, the spot, its slopes, its change with its width, and
/// the ghost, all Gaussians: linear in the light, so that noise has no bias.
/// @param sigma  px, of the spot
std::optional<Pair> fitted_pair(const Plane& plane, Vec2 place, Vec2 step, double sigma, double sigma_of_ghost) {
  constexpr double kReach = 2.5;  // sigmas
  const double reach = kReach * std::max(sigma, sigma_of_ghost);
  const double per_variance = 1 / (sigma * sigma), per_ghosts = 1 / (sigma_of_ghost * sigma_of_ghost);
  const int left = static_cast<int>(std::ceil(place.x + std::min(0.0, step.x) - reach));
  const int right = static_cast<int>(std::floor(place.x + std::max(0.0, step.x) + reach));
  const int top = static_cast<int>(std::ceil(place.y + std::min(0.0, step.y) - reach));
  const int bottom = static_cast<int>(std::floor(place.y + std::max(0.0, step.y) + reach));
  if (left < 0 || top < 0 || right >= plane.width || bottom >= plane.height) return std::nullopt;
  cv::Matx<double, 6, 6> normal = cv::Matx<double, 6, 6>::zeros();
  cv::Vec<double, 6> right_hand;
  for (int j = top; j <= bottom; ++j) {
    for (int i = left; i <= right; ++i) {
      const Vec2 d{i - place.x, j - place.y}, from_ghost = d - step;
      const double squared = per_variance * dot(d, d), of_ghost = per_ghosts * dot(from_ghost, from_ghost);
      if (std::min(squared, of_ghost) > kReach * kReach) continue;
      const double spot = std::exp(-0.5 * squared);
      const cv::Vec<double, 6> row(1, spot, spot * d.x, spot * d.y, spot * squared, std::exp(-0.5 * of_ghost));
      normal += row * row.t();
      right_hand += plane.at(i, j) * row;
    }
  }
  bool is_regular = false;
  const cv::Matx<double, 6, 6> inverse = normal.inv(cv::DECOMP_CHOLESKY, &is_regular);
  if (!is_regular || !(inverse(5, 5) > 0)) return std::nullopt;
  const cv::Vec<double, 6> found = inverse * right_hand;
  return Pair{found[1], found[5], 1 / inverse(5, 5)};
}

/// Weighted by information; its standard error is that of a median.
Ghosts median_share(std::vector<std::pair<double, double>> shares, bool is_relaxed) {
  constexpr std::size_t kFewest = 20;
  if (shares.size() < kFewest) return {};
  std::ranges::sort(shares);
  double all = 0, below = 0, median = 0;
  for (const auto& [share, weight] : shares) all += weight;
  for (const auto& [share, weight] : shares) {
    below += weight;
    median = share;
    if (below >= all / 2) break;
  }
  std::vector<double> deviations;
  for (const auto& [share, weight] : shares) deviations.push_back(std::sqrt(weight) * std::abs(share - median));
  constexpr double kOfMedian = 1.2533 * 1.4826;  // of a normal distribution, from the median deviation
  return {median, kOfMedian * numerics::quantile(std::move(deviations), 0.5) / std::sqrt(all), is_relaxed};
}

}  // namespace

Ghosts ghosts_of(const Scene& scene, const std::vector<Track>& tracks, const BeadSizes& sizes,
                 const std::optional<Turn>& turn) {
  constexpr double kNear = 0.5;    // bead sigmas: within it a bead and its ghost are one
  constexpr double kAlike = 1.25;  // the wings of beads far out of focus read as ghosts of up to 0.10
  if (std::max(sizes.ratio, 1 / sizes.ratio) > kAlike) return {};
  const double of_relaxed_px = scene.bead_sigma(), of_stressed_px = sizes.ratio * of_relaxed_px;
  const Plane &relaxed = scene.relaxed->image.plane, &stressed = scene.stressed.image.plane;
  const auto in = [&](bool is_relaxed) {
    std::vector<std::pair<double, double>> shares;
    for (int k = 0; k < scene.n_beads(); ++k) {
      if (!tracks[k].is_good()) continue;
      const Vec2 from = scene.position(k), to = from + tracks[k].found.motion.u;
      const Vec2 step = is_relaxed ? (turn ? turn->of(to) : to) - from : (turn ? turn->back(from) : from) - to;
      if (norm(step) < kNear * of_relaxed_px) continue;
      const auto at_rest = fitted_pair(relaxed, from, step, of_relaxed_px, of_stressed_px);
      const auto pulled = fitted_pair(stressed, to, step, of_stressed_px, of_relaxed_px);
      const auto &own = is_relaxed ? at_rest : pulled, &other = is_relaxed ? pulled : at_rest;
      if (!own || !other || !(own->height > 0) || !(other->height > 0)) continue;
      const double height = own->height + std::max(0.0, own->ghost);
      shares.emplace_back((own->ghost - other->ghost) / height, height * height * own->information);
    }
    return median_share(std::move(shares), is_relaxed);
  };
  const Ghosts of_relaxed = in(true), of_stressed = in(false);
  return of_relaxed.share > of_stressed.share ? of_relaxed : of_stressed;
}

}  // namespace mbtfm::beads
