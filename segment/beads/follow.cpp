#include "segment/beads/follow.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/core.hpp>
#include <optional>
#include <utility>

#include "pipeline/contract/errors.h"
#include "pipeline/numerics/order_statistics.h"
#include "segment/beads/local_motion.h"

namespace mbtfm::beads {

Gaps::Gaps(const Scene& scene, const std::vector<Track>& tracks) : scene_(scene), tracks_(tracks) {
  constexpr double kUsual = 16;
  constexpr int kFewest = 4;
  const Plane& plane = scene.relaxed->image.plane;
  const double area = static_cast<double>(plane.width) * plane.height;
  const double side = std::sqrt(area * kUsual / std::max(1, n_good(tracks)));
  nx_ = std::max(1, static_cast<int>(std::lround(plane.width / side)));
  ny_ = std::max(1, static_cast<int>(std::lround(plane.height / side)));
  side_x_ = static_cast<double>(plane.width) / nx_;
  side_y_ = static_cast<double>(plane.height) / ny_;
  std::vector<int> n(static_cast<std::size_t>(nx_) * ny_, 0);
  for (int k = 0; k < scene.n_beads(); ++k)
    if (tracks[k].is_good()) ++n[square_of(scene.position(k))];
  for (const int here : n) is_gap_.push_back(here < kFewest);
  share_ = static_cast<double>(std::ranges::count(is_gap_, true)) / static_cast<double>(is_gap_.size());
}

int Gaps::square_of(Vec2 place_px) const {
  const int i = std::clamp(static_cast<int>((place_px.x + 0.5) / side_x_), 0, nx_ - 1);
  const int j = std::clamp(static_cast<int>((place_px.y + 0.5) / side_y_), 0, ny_ - 1);
  return j * nx_ + i;
}

bool Gaps::are_large() const {
  constexpr double kNoticed = 0.02;
  return share_ >= kNoticed && std::ranges::count(is_gap_, true) >= 2;
}

bool Gaps::hold(Vec2 place_px) const { return is_gap_[square_of(place_px)]; }

bool Gaps::allow(Vec2 place_px, Vec2 u_px, double sigma_px) const {
  constexpr double kStrain = 0.3;  // gels are seldom strained by more between two places
  constexpr int kMost = 200;
  const double reach = 2 * std::hypot(side_x_, side_y_);  // the next squares but one
  bool has_witness = false;
  for (const int k : scene_.relaxed->neighbours.within(place_px, reach, kMost)) {
    if (!tracks_[k].is_good()) continue;
    has_witness = true;
    const Registered& bead = tracks_[k].found;
    const double granted = kStrain * norm(scene_.position(k) - place_px) + 4 * std::hypot(sigma_px, bead.sigma_px);
    if (norm(bead.motion.u - u_px) < granted) return true;
  }
  return !has_witness;
}

namespace {

constexpr int kAround = 12;
constexpr double kUnwitnessed = 2.0 / 3;  // of the beads: that many need no other witness than their number

/// What the good tracks around say of each good one, kept while tracks are found and rejected.
struct Surroundings {
  std::vector<Vec2> expected = {};  ///< by bead, px: taken off before beads are compared; empty: none
  std::vector<Motion> motions = {};
  std::vector<char> was_good = {}, is_changed = {};  ///< changed: a track around is another than at the update before
  std::vector<std::optional<LocalMotion>> around = {};
};

void update(const Scene& scene, const std::vector<Track>& tracks, Surroundings& s) {
  const std::vector<Motion> before = std::exchange(s.motions, motions_of(tracks));
  for (std::size_t k = 0; k < s.expected.size(); ++k) s.motions[k].u += -1 * s.expected[k];
  std::vector<char> is_good, is_other(tracks.size(), 1);
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    is_good.push_back(tracks[k].is_good());
    if (before.empty() || is_good[k] != s.was_good[k]) continue;
    is_other[k] = is_good[k] && !(before[k].u.x == s.motions[k].u.x && before[k].u.y == s.motions[k].u.y);
  }
  s.was_good = std::move(is_good);
  s.is_changed.assign(tracks.size(), 0);
  s.around.resize(tracks.size());
  for_each_bead(scene, [&](int k) {
    const std::vector<int>& near = scene.relaxed->around[k];
    const std::size_t n = std::min<std::size_t>(3 * kAround, near.size());  // those that good_around() looks at
    s.is_changed[k] = is_other[k];
    for (std::size_t at = 0; at < n && !s.is_changed[k]; ++at) s.is_changed[k] = is_other[near[at]];
    if (!s.is_changed[k]) return;
    s.around[k].reset();
    if (!tracks[k].is_good()) return;
    const std::vector<int> others = good_around(scene, tracks, k, kAround);
    s.around[k] = local_motion(scene.position(k), others, scene.relaxed->positions, s.motions);
    if (s.around[k] && !s.expected.empty()) s.around[k]->motion.u += s.expected[k];
  });
}

/// @param granted_px  by bead, besides; empty: 0
int flag_outliers(const std::vector<std::optional<LocalMotion>>& around, double threshold,
                  const std::vector<double>& granted_px, std::vector<Track>& tracks) {
  // Twelve neighbours know their spread to a third: it is no smaller than the picture's.
  const double typical = typical_spread(around);
  int n_outliers = 0;
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    if (!tracks[k].is_good()) continue;
    const auto& local = around[k];
    if (local && local->n_beads >= 3) {
      const double spread = std::max(local->spread_px, typical);
      const double misfit = norm(tracks[k].found.motion.u - local->motion.u);
      // The floor is what a field's curvature within the reach may do without being wrong.
      const double granted = 0.3 + (granted_px.empty() ? 0 : granted_px[k]);
      if (misfit <= threshold * std::hypot(spread, tracks[k].found.sigma_px) + granted) continue;
    }
    tracks[k].flag = TrackFlag::neighbours_disagree;
    ++n_outliers;
  }
  return n_outliers;
}

/// First round: from the grid.
void follow_grid(const Scene& scene, const GridField& grid, double least_similarity, std::vector<Track>& tracks) {
  for_each_bead(scene, [&](int k) {
    Track& track = tracks[k];
    const Motion guess = grid.at(scene.position(k));
    track.found = registered(scene.relaxed->image, scene.stressed.image.spline, scene.position(k), guess, scene.wide);
    const double moved = norm(track.found.motion.u - guess.u);
    // further than two bead widths from the guess a registration has caught another bead
    if (track.found.is_converged && track.found.similarity > least_similarity && moved < 4 * scene.bead_sigma()) {
      track.flag = TrackFlag::none;
    }
  });
}

/// Where the nearest good beads lead bead k, each by its own motion and gradient.
std::vector<Motion> extrapolated(const Scene& scene, const std::vector<Track>& tracks, int k) {
  constexpr int kNearest = 4;
  std::vector<Motion> guesses;
  for (const int j : good_around(scene, tracks, k, kNearest)) {
    guesses.push_back(tracks[j].found.motion);
    guesses.back().u = tracks[j].found.motion.at(scene.position(k) - scene.position(j));
  }
  return guesses;
}

/// Whether one of the nearest beads leads elsewhere: to where another bead may lie.
bool is_challenged(const Scene& scene, const Track& track, const std::vector<Motion>& extrapolated) {
  return std::ranges::any_of(
      extrapolated, [&](const Motion& guess) { return norm(guess.u - track.found.motion.u) > 2 * scene.bead_sigma(); });
}

/// A track of bead k from what its neighbours do: their affine motion itself, the stressed image's beads near where it
/// leads, and where each of the nearest leads by itself (Pan, Appl. Opt. 48:1535, 2009); the most similar counts.
std::optional<Registered> retried(const Scene& scene, const std::vector<Track>& tracks,
                                  const std::vector<Motion>& motions, int k, double least_similarity, Led led) {
  if (tracks[k].is_good() && led == Led::together) return std::nullopt;
  const Vec2 place = scene.position(k);
  const std::vector<Motion> single = led == Led::by_each ? extrapolated(scene, tracks, k) : std::vector<Motion>{};
  if (tracks[k].is_good() && !is_challenged(scene, tracks[k], single)) return std::nullopt;
  const auto local = local_motion(place, good_around(scene, tracks, k, 8), scene.relaxed->positions, motions);
  if (!local || local->n_beads < 3) return std::nullopt;
  const double search = std::clamp(4 * local->spread_px, 2 * scene.bead_sigma(), 5 * scene.bead_sigma());
  Window window = scene.wide;
  window.sigma = std::max(2.2 * scene.bead_sigma(), 0.6 * scene.wide.sigma);
  window.is_thinned = false;
  std::optional<Registered> best;
  const auto look = [&](const Motion& guess, Vec2 around) {
    const Registered found = registered(scene.relaxed->image, scene.stressed.image.spline, place, guess, window);
    if (!found.is_converged || norm(found.motion.u - around) > search) return;
    if (found.similarity > std::max(least_similarity, best ? best->similarity : -1)) best = found;
  };
  look(local->motion, local->motion.u);
  for (const int b : scene.stressed.neighbours.within(place + local->motion.u, search, 4)) {
    Motion guess = local->motion;
    guess.u = scene.stressed.positions[b] - place;
    look(guess, local->motion.u);
  }
  std::vector<Vec2> known = {local->motion.u};  // no need to begin within two bead sigmas once more
  for (const Motion& guess : single) {
    const auto is_known = [&](Vec2 u) { return norm(u - guess.u) < 2 * scene.bead_sigma(); };
    if (std::ranges::any_of(known, is_known)) continue;
    look(guess, guess.u);
    known.push_back(guess.u);
  }
  return best;
}

/// A track that was found is given up for one of half its mismatch.
bool is_better(const Track& track, const Registered& found) {
  return !track.is_good() || 1 - found.similarity < 0.5 * (1 - track.found.similarity);
}

void follow_neighbours(const Scene& scene, const TrackParameters& parameters, Led led, Surroundings& surroundings,
                       std::vector<Track>& tracks) {
  constexpr int kMaxRounds = 12;
  for (int round = 0; round < kMaxRounds; ++round) {
    std::vector<std::optional<Registered>> found(tracks.size());
    for_each_bead(scene, [&](int k) {
      if (!surroundings.is_changed[k]) return;
      // a narrow window may take a stranger for the bead: more is asked of it
      found[k] = retried(scene, tracks, surroundings.motions, k, 0.5 * (1 + parameters.least_similarity), led);
    });
    int n_found = 0;
    for (std::size_t k = 0; k < tracks.size(); ++k) {
      if (!found[k] || !is_better(tracks[k], *found[k])) continue;
      tracks[k] = {.found = *found[k], .flag = TrackFlag::none};
      ++n_found;
    }
    update(scene, tracks, surroundings);
    const int n_rejected = flag_outliers(surroundings.around, parameters.outlier_threshold, {}, tracks);
    if (n_found <= n_rejected) break;
  }
}

}  // namespace

void require_common_beads(int n_by_grid, int n_in_the_end, int n_beads) {
  constexpr double kFewest = 0.2;
  const int n_found = std::min(n_by_grid, n_in_the_end);
  if (n_found >= kFewest * n_beads || n_in_the_end >= kUnwitnessed * n_beads) return;
  throw NotFollowed("the stressed image", "the beads of the relaxed image, displaced",
                    std::to_string(n_found) + " of " + std::to_string(n_beads) + " of them");
}

Followed follow(const Scene& scene, const GridField& grid, const TrackParameters& parameters, Led led) {
  std::vector<Track> tracks(scene.relaxed->beads.size());
  follow_grid(scene, grid, parameters.least_similarity, tracks);
  Surroundings surroundings;
  update(scene, tracks, surroundings);
  flag_outliers(surroundings.around, parameters.outlier_threshold, {}, tracks);
  const int n_by_grid = n_good(tracks);
  // squares that hold sixteen of few good beads are too large to be gaps
  const bool has_gaps = n_by_grid < kUnwitnessed * scene.n_beads() || Gaps(scene, tracks).are_large();
  follow_neighbours(scene, parameters, led, surroundings, tracks);
  return {.tracks = std::move(tracks), .n_by_grid = n_by_grid, .period_px = grid.period, .has_gaps = has_gaps};
}

std::vector<std::optional<LocalMotion>> motions_around(const Scene& scene, const std::vector<Track>& tracks,
                                                       const std::vector<Vec2>& expected) {
  Surroundings surroundings{.expected = expected};
  update(scene, tracks, surroundings);
  return std::move(surroundings.around);
}

double typical_spread(const std::vector<std::optional<LocalMotion>>& around) {
  std::vector<double> spreads;
  for (const auto& local : around) {
    if (local && local->n_beads >= 3) spreads.push_back(local->spread_px);
  }
  return numerics::quantile(std::move(spreads), 0.5);
}

int flag_outliers(const Scene& scene, double threshold, std::vector<Track>& tracks) {
  return flag_outliers(motions_around(scene, tracks), threshold, {}, tracks);
}

std::vector<double> missed_around(const Scene& scene, const std::vector<Track>& tracks,
                                  const std::vector<std::optional<LocalMotion>>& beside) {
  const auto around = motions_around(scene, tracks);
  std::vector<double> missed_px(tracks.size(), 0);
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    if (around[k] && beside[k]) missed_px[k] = norm(beside[k]->motion.u - around[k]->motion.u);
  }
  return missed_px;
}

int flag_outliers_beside(const std::vector<Vec2>& expected, const Scene& scene, double threshold,
                         std::vector<Track>& tracks) {
  // An adhesion that is drawn at half its width, or pulls at its rim alone, moves its middle by so much more or less.
  constexpr double kWrong = 0.5;
  const auto beside = motions_around(scene, tracks, expected);
  std::vector<double> granted_px = missed_around(scene, tracks, beside);
  for (double& granted : granted_px) granted *= kWrong;
  return flag_outliers(beside, threshold, granted_px, tracks);
}

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
  double step_px = 0;    ///< length of U
  double spread_px = 0;  ///< of the others about the fit
};

/// Fit of c, G, H and a, those further off and outliers weighing less, as in local_motion().
std::optional<Pull> pull_of(const Scene& scene, const std::vector<Track>& tracks, int bead,
                            const std::vector<int>& around, double least_spread_px) {
  constexpr std::size_t kFewest = 12;  // thirteen numbers from twenty-four
  constexpr int kRows = 6, kAll = 2 * kRows + 1;
  using Row = cv::Vec<double, kAll>;
  if (around.size() < kFewest) return std::nullopt;
  const Vec2 place = scene.position(bead), u = tracks[bead].found.motion.u;
  const auto start = local_motion(place, around, scene.relaxed->positions, motions_of(tracks), Order::curved);
  Vec2 rest = start->motion.u;
  const double reach = start->reach_px;
  std::vector<double> trust(around.size(), 1);
  Pull pull;
  constexpr int kRounds = 4;
  for (int round = 0; round < kRounds; ++round) {
    cv::Matx<double, kAll, kAll> normal, squared;
    Row right;
    std::vector<std::pair<Row, Row>> rows(around.size());
    for (std::size_t k = 0; k < around.size(); ++k) {
      const Vec2 d = scene.position(around[k]) - place, moved = tracks[around[k]].found.motion.u;
      const double softened = std::hypot(norm(d), 2 * scene.bead_sigma());  // within the patch all move alike
      const Vec2 e = (1 / softened) * d, own = u - rest, pulled = (1 / softened) * (own + dot(own, e) * e);
      const Vec2 r = (1 / reach) * d;
      const double smooth[kRows] = {1, r.x, r.y, r.x * r.x, r.x * r.y, r.y * r.y};
      for (int a = 0; a < kRows; ++a) rows[k].first[a] = rows[k].second[kRows + a] = smooth[a];
      rows[k].first[2 * kRows] = pulled.x, rows[k].second[2 * kRows] = pulled.y;
      const double weight = trust[k] * std::exp(-2 * dot(d, d) / (reach * reach));
      for (const auto& [row, value] : {std::pair(rows[k].first, moved.x), std::pair(rows[k].second, moved.y)}) {
        normal += weight * row * row.t();
        squared += weight * weight * row * row.t();
        right += weight * value * row;
      }
    }
    bool is_regular = false;
    const auto inverse = normal.inv(cv::DECOMP_CHOLESKY, &is_regular);
    if (!is_regular) return std::nullopt;
    const Row fitted = inverse * right;
    std::vector<double> misfits;
    for (std::size_t k = 0; k < around.size(); ++k) {
      const Vec2 moved = tracks[around[k]].found.motion.u;
      misfits.push_back(norm(moved - Vec2{rows[k].first.dot(fitted), rows[k].second.dot(fitted)}));
    }
    const double n = static_cast<double>(around.size());
    const double free = n - 0.5 * kAll;
    const double spread = std::max(numerics::quantile(misfits, 0.5) / 1.18 * std::sqrt(n / free), least_spread_px);
    for (std::size_t k = 0; k < around.size(); ++k)
      trust[k] = std::pow(std::min(1.0, 2.5 * spread / std::max(misfits[k], 1e-9)), 2);
    rest = {fitted[0], fitted[kRows]};
    const double variance = (inverse * squared * inverse)(2 * kRows, 2 * kRows);
    pull = {fitted[2 * kRows], spread * std::sqrt(variance), norm(u - rest), spread};
  }
  return pull;
}

/// Whether a = 0 is likelier than the least radius by two standard deviations: twice the logarithm of the ratio.
bool is_unlikely(const Pull& pull, double least_px) {
  const auto square = [&](double radius_px) { return std::pow((pull.radius_px - radius_px) / pull.sigma_px, 2); };
  return square(least_px) - square(0) > 4;
}

}  // namespace

int flag_unpulled(const Scene& scene, double threshold, const std::vector<char>& is_contradicted, double scatter_px,
                  std::vector<Track>& tracks) {
  const std::vector<int> group = groups_of(scene, tracks);
  std::vector<int> size(tracks.size(), 0);
  for (std::size_t k = 0; k < tracks.size(); ++k) size[group[k]] += tracks[k].is_good();
  const int largest = static_cast<int>(std::ranges::max_element(size) - size.begin());
  std::vector<char> is_alone(tracks.size(), 0);
  for_each_bead(scene, [&](int k) {
    if (!tracks[k].is_good() || !(is_contradicted[k] || group[k] != group[largest])) return;
    constexpr int kMost = 24;
    std::vector<int> witnesses = good_around(scene, tracks, k, 2 * kMost);
    std::erase_if(witnesses, [&](int j) { return group[j] != group[largest]; });
    if (witnesses.size() > kMost) witnesses.resize(kMost);
    const double sigma_px = std::hypot(scatter_px, tracks[k].found.sigma_px);
    const std::optional<Pull> pull = pull_of(scene, tracks, k, witnesses, sigma_px);
    if (!pull) return;
    const double limit_px = threshold * std::hypot(pull->spread_px, sigma_px);
    is_alone[k] = pull->step_px > limit_px && is_unlikely(*pull, scene.bead_sigma());
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
