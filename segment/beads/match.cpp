#include "segment/beads/measure.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::beads {
namespace {

constexpr double kLost = 0.4;        // p0: of the beads that no window finds so many are in one image only
constexpr double kStranger = 0.05;   // so often a neighbour says nothing of a bead: it may be wrong itself
constexpr double kMixedLight = 0.1;  // so often a spot has another bead's light, too
constexpr double kStrain = 0.3;      // gels are seldom strained by more between two beads
constexpr double kStrainLeft = 0.1;  // beside what forces on the adhesions explain
constexpr int kAround = 12;
constexpr double kWitnesses = 4;  // what the dozen know together, since in part they know it from each other
constexpr double kCertain = 0.7;

struct Candidate {
  int spot = 0;
  Vec2 u;            ///< beside what is expected
  double light = 0;  ///< logarithm of how much likelier than any other bead's the spot's light is
  double odds = 0;
  double probability = 0.1;
};

struct Witness {
  int bead = 0;
  double weight = 0;
  double distance_px = 0;
};

struct Leftover {
  int bead = 0;
  std::vector<Candidate> candidates;
  std::vector<Witness> around;
  double matched() const {
    double sum = 0;
    for (const Candidate& c : candidates) sum += c.probability;
    return sum;
  }
};

/// Light of a bead's spot over that of the bead itself, as logarithms.
struct Light {
  double mean = 0, sd = 1;  ///< of one bead in both images
  double sd_any = 1;        ///< of any two beads
  double log_ratio(double log_light) const {
    const auto density = [&](double sd_of) { return std::exp(-0.5 * std::pow((log_light - mean) / sd_of, 2)) / sd_of; };
    const double any = std::max(density(sd_any), 1e-3 / sd_any);
    return std::log(((1 - kMixedLight) * density(sd) + kMixedLight * density(sd_any)) / any);
  }
};

double robust_sd(std::vector<double> values, double middle) {
  for (double& value : values) value = std::abs(value - middle);
  return std::max(0.02, numerics::quantile(std::move(values), 0.5) / 0.6745);  // light is no better known than to 2 %
}

double log_light(const DetectedBead& bead) { return std::log(std::max(bead.brightness, 1e-6)); }

Light light_of(const Scene& scene, const std::vector<Track>& tracks) {
  std::vector<double> same, all;
  for (int k = 0; k < scene.n_beads(); ++k) {
    all.push_back(log_light(scene.relaxed->beads[k]));
    if (!tracks[k].is_good()) continue;
    const Vec2 end = scene.position(k) + tracks[k].found.motion.u;
    for (const int b : scene.stressed.neighbours.within(end, 0.5 * scene.bead_sigma(), 1)) {
      same.push_back(log_light(scene.stressed.beads[b]) - all.back());
    }
  }
  const double mean = numerics::quantile(same, 0.5);
  const double sd_all = robust_sd(all, numerics::quantile(all, 0.5));
  return {.mean = mean, .sd = robust_sd(std::move(same), mean), .sd_any = std::numbers::sqrt2 * sd_all};
}

/// All that is to be matched, and what it is matched by.
struct Matching {
  const Scene& scene;
  const std::vector<Track>& tracks;
  const std::vector<Vec2>& expected;
  double scatter_px = 0;
  double reach_px = 0;
  double free_in_reach = 1;        ///< spots to be expected by chance
  std::vector<int> leftover_of{};  ///< by bead; -1: it has a good track, or has left the picture
  std::vector<Leftover> leftovers{};
  Vec2 expected_of(int bead) const { return expected.empty() ? Vec2{} : expected[bead]; }
  /// Of a good track, beside what is expected.
  Vec2 step_of(int bead) const { return tracks[bead].found.motion.u - expected_of(bead); }
  double area_px2() const { return std::numbers::pi * reach_px * reach_px; }
  /// A f: density of steps that differ from a neighbour's by this vector, over that of chance.
  double likeness(Vec2 difference, double distance_px) const {
    const double variance =
        2 * scatter_px * scatter_px + std::pow((expected.empty() ? kStrain : kStrainLeft) * distance_px, 2);
    const double tail = 1 + dot(difference, difference) / (2 * variance);
    return area_px2() / (2 * std::numbers::pi * variance * tail * tail);
  }
};

/// Spots of the stressed image to which no good track leads.
std::vector<char> free_spots(const Scene& scene, const std::vector<Track>& tracks) {
  std::vector<char> is_free(scene.stressed.beads.size(), 1);
  for (int k = 0; k < scene.n_beads(); ++k) {
    if (!tracks[k].is_good()) continue;
    const Vec2 end = scene.position(k) + tracks[k].found.motion.u;
    for (const int b : scene.stressed.neighbours.within(end, scene.bead_sigma(), 4)) is_free[b] = 0;
  }
  return is_free;
}

/// Where the good tracks nearby lead on the whole.
Vec2 middle_step(const Matching& all, const std::vector<Witness>& around) {
  std::vector<double> x, y;
  for (const Witness& witness : around) {
    if (!all.tracks[witness.bead].is_good()) continue;
    const Vec2 step = all.step_of(witness.bead);
    x.push_back(step.x);
    y.push_back(step.y);
  }
  return {numerics::quantile(std::move(x), 0.5), numerics::quantile(std::move(y), 0.5)};
}

Leftover leftover(const Matching& all, int bead, const std::vector<char>& is_free, const Light& light) {
  const Scene& scene = all.scene;
  const Vec2 place = scene.position(bead);
  Leftover result{.bead = bead, .candidates = {}, .around = {}};
  const std::vector<int>& near = scene.relaxed->around[bead];
  for (std::size_t at = 0; at < std::min<std::size_t>(kAround, near.size()); ++at) {
    const int j = near[at];
    if (!all.tracks[j].is_good() && all.leftover_of[j] < 0) continue;
    const double distance = norm(scene.position(j) - place);
    const double weight = std::exp(-0.5 * std::pow(distance / scene.spacing(), 2));
    result.around.push_back({.bead = j, .weight = weight, .distance_px = distance});
  }
  const Vec2 from = place + all.expected_of(bead), centre = from + middle_step(all, result.around);
  constexpr int kMost = 40;  // three times what a reach of two distances holds
  for (const int b : scene.stressed.neighbours.within(centre, all.reach_px, kMost)) {
    if (!is_free[b]) continue;
    const double brighter = log_light(scene.stressed.beads[b]) - log_light(scene.relaxed->beads[bead]);
    result.candidates.push_back(
        {.spot = b, .u = scene.stressed.positions[b] - from, .light = light.log_ratio(brighter)});
  }
  return result;
}

Matching matching(const Scene& scene, const std::vector<Track>& tracks, double scatter_px,
                  const std::vector<Vec2>& expected) {
  Matching all{.scene = scene, .tracks = tracks, .expected = expected, .scatter_px = scatter_px};
  all.reach_px = 2 * scene.spacing();  // a peak is a few beads wide; further away chance offers too many spots
  const std::vector<char> is_free = free_spots(scene, tracks);
  const Plane& plane = scene.stressed.image.plane;
  const double density = static_cast<double>(std::count(is_free.begin(), is_free.end(), 1)) /
                         (static_cast<double>(plane.width) * plane.height);
  all.free_in_reach = std::max(1e-3, density * all.area_px2());
  all.leftover_of.assign(tracks.size(), -1);
  std::vector<int> beads;
  for (int k = 0; k < scene.n_beads(); ++k) {
    if (tracks[k].is_good() || tracks[k].flag == TrackFlag::edge) continue;
    all.leftover_of[k] = static_cast<int>(beads.size());
    beads.push_back(k);
  }
  const Light light = light_of(scene, tracks);
  for (const int bead : beads) all.leftovers.push_back(leftover(all, bead, is_free, light));
  return all;
}

/// Σ w log(A f): what the beads around say of a step; each as far as it has one itself.
double log_support(const Matching& all, const Leftover& of, const Candidate& candidate) {
  double sum = 0, weights = 0;
  for (const Witness& witness : of.around) {
    double likeness = 0, certainty = 1;
    if (all.tracks[witness.bead].is_good()) {
      const Vec2 difference = candidate.u - all.step_of(witness.bead);
      likeness = (1 - kStranger) * all.likeness(difference, witness.distance_px);
    } else {
      const Leftover& other = all.leftovers[all.leftover_of[witness.bead]];
      certainty = other.matched();
      likeness = std::max(0.0, 1 - certainty);
      for (const Candidate& c : other.candidates) {
        if (c.spot == candidate.spot) continue;
        likeness += c.probability * all.likeness(candidate.u - c.u, witness.distance_px);
      }
    }
    sum += witness.weight * certainty * std::log(likeness + kStranger);
    weights += witness.weight * certainty;
  }
  return weights > kWitnesses ? sum * kWitnesses / weights : sum;
}

void iterate(Matching& all) {
  std::vector<double> odds_of_spot(all.scene.stressed.beads.size(), 0);
  const double log_chance = std::log((1 - kLost) / (kLost * all.free_in_reach));
  for (Leftover& leftover : all.leftovers) {
    for (Candidate& c : leftover.candidates) {
      constexpr double kMost = 50;  // certain, and finite
      c.odds = std::exp(std::min(kMost, log_chance + c.light + log_support(all, leftover, c)));
      odds_of_spot[c.spot] += c.odds;
    }
  }
  for (Leftover& leftover : all.leftovers) {
    double odds_of_bead = 0;
    for (const Candidate& c : leftover.candidates) odds_of_bead += c.odds;
    for (Candidate& c : leftover.candidates) {
      const double next = c.odds / (1 + odds_of_bead + odds_of_spot[c.spot] - c.odds);
      c.probability = 0.5 * (c.probability + next);  // damped: neighbours that wait for each other would swing
    }
  }
}

}  // namespace

std::vector<std::optional<int>> matched_spots(const Scene& scene, const std::vector<Track>& tracks, double scatter_px,
                                              const std::vector<Vec2>& expected) {
  Matching all = matching(scene, tracks, scatter_px, expected);
  constexpr int kRounds = 20;  // halved each time, what is settled is settled to 1e-6
  for (int round = 0; round < kRounds; ++round) iterate(all);
  std::vector<std::optional<int>> spots(tracks.size());
  for (const Leftover& leftover : all.leftovers) {
    for (const Candidate& c : leftover.candidates) {
      if (c.probability > kCertain) spots[leftover.bead] = c.spot;
    }
  }
  return spots;
}

}  // namespace mbtfm::beads
