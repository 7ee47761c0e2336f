#include "segment/beads/pull.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/core.hpp>

#include "pipeline/numerics/order_statistics.h"
#include "segment/beads/follow.h"
#include "segment/beads/local_motion.h"

namespace mbtfm::beads {
namespace {

/// By bead, the group that it is in: beads that differ from a neighbour by less than half of their distance.
std::vector<int> groups_of(const Scene& scene, const std::vector<Track>& tracks) {
  constexpr double kStrain = 0.5;  // more is seldom, and no proof: such beads are asked
  constexpr int kNeighbours = 8;
  std::vector<int> parent(tracks.size());
  std::iota(parent.begin(), parent.end(), 0);
  const auto root = [&](int k) {
    while (parent[k] != k) k = parent[k] = parent[parent[k]];
    return k;
  };
  for (int k = 0; k < scene.n_beads(); ++k) {
    if (!tracks[k].is_good()) continue;
    for (const int j : good_around(scene, tracks, k, kNeighbours)) {
      const double step = norm(tracks[k].found.motion.u - tracks[j].found.motion.u);
      if (step < kStrain * norm(scene.position(k) - scene.position(j)) + 0.3) parent[root(j)] = root(k);
    }
  }
  for (int k = 0; k < scene.n_beads(); ++k) parent[k] = root(k);
  return parent;
}

struct Pull {
  double radius_px = 0, sigma_px = 0;
  double step_px = 0;  ///< length of U
};

using Vec7 = cv::Vec<double, 7>;
using Mat7 = cv::Matx<double, 7, 7>;

/// Fit of c, G and a, those further off and outliers weighing less, as in local_motion().
std::optional<Pull> pull_of(const Scene& scene, const std::vector<Track>& tracks, int bead,
                            const std::vector<int>& around, double least_spread_px) {
  constexpr std::size_t kFewest = 8;  // seven numbers from sixteen
  if (around.size() < kFewest) return std::nullopt;
  const Vec2 place = scene.position(bead), u = tracks[bead].found.motion.u;
  const auto start = local_motion(place, around, scene.relaxed->positions, motions_of(tracks));
  Vec2 rest = start->motion.u;
  const double reach = start->reach_px;
  std::vector<double> trust(around.size(), 1);
  Pull pull;
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    Mat7 normal, squared;
    Vec7 right;
    std::vector<std::pair<Vec7, Vec7>> rows;
    for (std::size_t k = 0; k < around.size(); ++k) {
      const Vec2 d = scene.position(around[k]) - place, moved = tracks[around[k]].found.motion.u;
      const double softened = std::hypot(norm(d), 2 * scene.bead_sigma());  // within the patch all move alike
      const Vec2 e = (1 / softened) * d, own = u - rest, pulled = (1 / softened) * (own + dot(own, e) * e);
      rows.push_back({{1, d.x, d.y, 0, 0, 0, pulled.x}, {0, 0, 0, 1, d.x, d.y, pulled.y}});
      const double weight = trust[k] * std::exp(-2 * dot(d, d) / (reach * reach));
      for (const auto& [row, value] : {std::pair(rows.back().first, moved.x), std::pair(rows.back().second, moved.y)}) {
        normal += weight * row * row.t();
        squared += weight * weight * row * row.t();
        right += weight * value * row;
      }
    }
    bool is_regular = false;
    const Mat7 inverse = normal.inv(cv::DECOMP_CHOLESKY, &is_regular);
    if (!is_regular) return std::nullopt;
    const Vec7 fitted = inverse * right;
    std::vector<double> misfits;
    for (std::size_t k = 0; k < around.size(); ++k) {
      const Vec2 moved = tracks[around[k]].found.motion.u;
      misfits.push_back(norm(moved - Vec2{rows[k].first.dot(fitted), rows[k].second.dot(fitted)}));
    }
    const double n = static_cast<double>(around.size());
    const double spread = std::max(numerics::quantile(misfits, 0.5) / 1.18 * std::sqrt(n / (n - 3.5)), least_spread_px);
    for (std::size_t k = 0; k < around.size(); ++k)
      trust[k] = std::pow(std::min(1.0, 2.5 * spread / std::max(misfits[k], 1e-9)), 2);
    rest = {fitted[0], fitted[3]};
    pull = {fitted[6], spread * std::sqrt((inverse * squared * inverse)(6, 6)), norm(u - rest)};
  }
  return pull;
}

/// Whether a = 0 is likelier than the least radius: twice the logarithm of the ratio is above 1.
bool is_unlikely(const Pull& pull, double least_px) {
  const auto square = [&](double radius_px) { return std::pow((pull.radius_px - radius_px) / pull.sigma_px, 2); };
  return square(least_px) - square(0) > 1;
}

}  // namespace

int flag_unpulled(const Scene& scene, double threshold, std::vector<Track>& tracks) {
  const std::vector<int> group = groups_of(scene, tracks);
  std::vector<int> size(tracks.size(), 0);
  for (std::size_t k = 0; k < tracks.size(); ++k) size[group[k]] += tracks[k].is_good();
  const int largest = static_cast<int>(std::ranges::max_element(size) - size.begin());
  const std::vector<std::optional<LocalMotion>> around = motions_around(scene, tracks);
  const double typical = typical_spread(around);
  const auto limit_px = [&](int k) {
    constexpr double kResolved = 1.5;  // bead sigmas: nearer than that lies a bead's own light, and no other's
    const double as_outliers = threshold * std::hypot(typical, tracks[k].found.sigma_px) + 0.3;  // flag_outliers()
    return std::max(kResolved * scene.bead_sigma(), as_outliers);
  };
  const auto is_asked = [&](int k) {
    if (group[k] != group[largest] || !around[k]) return true;
    return norm(tracks[k].found.motion.u - around[k]->motion.u) > limit_px(k);
  };
  std::vector<char> is_alone(tracks.size(), 0);
  for_each_bead(scene, [&](int k) {
    if (!tracks[k].is_good() || !is_asked(k)) return;
    constexpr int kAround = 20;
    std::vector<int> witnesses = good_around(scene, tracks, k, 2 * kAround);
    std::erase_if(witnesses, [&](int j) { return group[j] != group[largest]; });
    if (witnesses.size() > kAround) witnesses.resize(kAround);
    const std::optional<Pull> pull = pull_of(scene, tracks, k, witnesses, typical);
    is_alone[k] = pull && pull->step_px > limit_px(k) && is_unlikely(*pull, scene.bead_sigma());
  });
  int n_flagged = 0;
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    if (!is_alone[k]) continue;
    tracks[k].flag = TrackFlag::neighbours_disagree;
    ++n_flagged;
  }
  return n_flagged;
}

}  // namespace mbtfm::beads
