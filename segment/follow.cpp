#include "segment/follow.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "pipeline/contract/errors.h"
#include "segment/local_motion.h"

namespace mbtfm::segment {
namespace {

bool is_inside(const Plane& plane, Vec2 place, double margin) {
  return place.x >= margin && place.y >= margin && place.x <= plane.width - 1 - margin &&
         place.y <= plane.height - 1 - margin;
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
      track.flag.clear();
    }
  });
}

/// A track of bead k from what its neighbours do: their affine motion itself, and the stressed image's beads near where
/// it leads; the most similar counts.
std::optional<Registered> retried(const Scene& scene, const std::vector<Track>& tracks,
                                  const std::vector<Motion>& motions, int k, double least_similarity) {
  const Vec2 place = scene.position(k);
  const auto local = local_motion(place, good_around(scene, tracks, k, 8), scene.relaxed->positions, motions);
  if (!local || local->n_beads < 3) return std::nullopt;
  std::vector<Motion> guesses = {local->motion};
  const double search = std::clamp(4 * local->spread_px, 2 * scene.bead_sigma(), 5 * scene.bead_sigma());
  for (const int b : scene.stressed.neighbours.within(place + local->motion.u, search, 4)) {
    guesses.push_back(local->motion);
    guesses.back().u = scene.stressed.positions[b] - place;
  }
  Window window = scene.wide;
  window.sigma = std::max(2.2 * scene.bead_sigma(), 0.6 * scene.wide.sigma);
  window.is_thinned = false;
  std::optional<Registered> best;
  for (const Motion& guess : guesses) {
    const Registered found = registered(scene.relaxed->image, scene.stressed.image.spline, place, guess, window);
    if (!found.is_converged || norm(found.motion.u - local->motion.u) > search) continue;
    if (found.similarity > std::max(least_similarity, best ? best->similarity : -1)) best = found;
  }
  return best;
}

void follow_neighbours(const Scene& scene, const TrackParameters& parameters, std::vector<Track>& tracks) {
  constexpr int kMaxRounds = 12;
  for (int round = 0; round < kMaxRounds; ++round) {
    const std::vector<Motion> motions = motions_of(tracks);
    std::vector<std::optional<Registered>> found(tracks.size());
    for_each_bead(scene, [&](int k) {
      if (tracks[k].is_good()) return;
      // a narrow window may take a stranger for the bead: more is asked of it
      found[k] = retried(scene, tracks, motions, k, 0.5 * (1 + parameters.least_similarity));
    });
    int n_found = 0;
    for (std::size_t k = 0; k < tracks.size(); ++k) {
      if (!found[k]) continue;
      tracks[k] = {.found = *found[k], .flag = {}};
      ++n_found;
    }
    const int n_rejected = flag_outliers(scene, parameters.outlier_threshold, tracks);
    if (n_found <= n_rejected) break;
  }
}

/// What similarity a right match has depends on the noise, so the picture itself tells: a bead that is less similar
/// by eight times the median lack of it shows another bead. Steep places cost similarity too: a tenth is granted.
void flag_dissimilar(double least_similarity, std::vector<Track>& tracks) {
  std::vector<double> lacks;
  for (const Track& track : tracks) {
    if (track.is_good()) lacks.push_back(1 - track.found.similarity);
  }
  const double most = std::min(std::max(0.1, 8 * quantile(std::move(lacks), 0.5)), 1 - least_similarity);
  for (Track& track : tracks) {
    if (track.is_good() && 1 - track.found.similarity > most) track.flag = "no partner";
  }
}

/// A bead keeps its light. One whose gain differs from its neighbours' by more than five robust standard deviations
/// (of the picture's beads, each in units of its own error, which is that of its place over its width) took another's
/// place, or lies on top of another that moved away.
void flag_changed_light(const Scene& scene, std::vector<Track>& tracks) {
  constexpr double kMost = 5, kFloor = 0.02;  // the floor: light is no better known than that
  std::vector<double> deviation(tracks.size(), 0);
  for_each_bead(scene, [&](int k) {
    const Registered& found = tracks[k].found;
    if (!tracks[k].is_good() || !(found.gain > 0)) return;
    std::vector<double> around;
    for (const int j : good_around(scene, tracks, k, 12))
      around.push_back(std::log(std::max(1e-3, tracks[j].found.gain)));
    if (around.size() < 5) return;
    const double error = std::hypot(found.sigma_px / scene.bead_sigma(), kFloor);
    deviation[k] = std::abs(std::log(found.gain) - quantile(std::move(around), 0.5)) / error;
  });
  std::vector<double> sizes;
  for (const double size : deviation) {
    if (size > 0) sizes.push_back(size);
  }
  const double most = kMost * quantile(std::move(sizes), 0.5) / 0.6745;
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    if (tracks[k].is_good() && deviation[k] > most) tracks[k].flag = "ambiguous";
  }
}

/// The motion from the target back to the reference; nothing where it folds the surface.
std::optional<Motion> inverse(const Motion& forward) {
  const double xx = 1 + forward.ux_x, yy = 1 + forward.uy_y, xy = forward.ux_y, yx = forward.uy_x;
  const double determinant = xx * yy - xy * yx;
  if (!(determinant > 0.1)) return std::nullopt;
  return Motion{-1 * forward.u, yy / determinant - 1, -xy / determinant, -yx / determinant, xx / determinant - 1};
}

void check_backwards(const Scene& scene, std::vector<Track>& tracks) {
  Window window = scene.narrow;
  window.max_steps = 6;
  window.settled_px = 0.02;
  for_each_bead(scene, [&](int k) {
    Track& track = tracks[k];
    if (!track.is_good()) return;
    const Motion& forward = track.found.motion;
    const Vec2 there = scene.position(k) + forward.u;
    if (!is_inside(scene.stressed.image.plane, there, 2 * scene.bead_sigma())) {
      track.flag = "edge";
      return;
    }
    const auto back = inverse(forward);
    if (!back) {
      track.flag = "ambiguous";
      return;
    }
    const Registered returned = registered(scene.stressed.image, scene.relaxed->image.spline, there, *back, window);
    const double missed = norm(returned.motion.u + forward.u);
    if (missed > 0.5 + 4 * std::hypot(track.found.sigma_px, returned.sigma_px)) track.flag = "ambiguous";
    // Both ways see the same noise: what they differ by is what the registration itself is unsure of.
    track.found.sigma_px = std::hypot(track.found.sigma_px, missed / 2);
  });
}

/// Two beads cannot go to one place: the less similar one is wrong.
void check_claims(const Scene& scene, std::vector<Track>& tracks) {
  std::vector<Vec2> ends;
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    ends.push_back(scene.position(static_cast<int>(k)) + tracks[k].found.motion.u);
  }
  const Neighbours neighbours(ends, std::max(4.0, scene.spacing()));
  std::vector<char> is_taken(tracks.size(), 0);
  for_each_bead(scene, [&](int k) {
    if (!tracks[k].is_good()) return;
    for (const int other : neighbours.within(ends[k], 0.6 * scene.bead_sigma(), 6)) {
      if (other == k || !tracks[other].is_good()) continue;
      // they were one blot before
      if (norm(scene.position(k) - scene.position(other)) < 1.5 * scene.bead_sigma()) continue;
      const double mine = tracks[k].found.similarity, theirs = tracks[other].found.similarity;
      if (mine < theirs || (mine == theirs && k > other)) is_taken[k] = 1;
    }
  });
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    if (is_taken[k]) tracks[k].flag = "ambiguous";
  }
}

}  // namespace

void require_common_beads(int n_found, int n_beads) {
  constexpr double kFewest = 0.2;
  if (n_found >= kFewest * n_beads) return;
  throw InvalidData("the stressed image", "the beads of the relaxed image, displaced",
                    std::to_string(n_found) + " of " + std::to_string(n_beads) + " of them");
}

std::vector<Track> follow(const Scene& scene, const GridField& grid, const TrackParameters& parameters) {
  std::vector<Track> tracks(scene.relaxed->beads.size());
  follow_grid(scene, grid, parameters.least_similarity, tracks);
  flag_outliers(scene, parameters.outlier_threshold, tracks);
  require_common_beads(static_cast<int>(std::count_if(tracks.begin(), tracks.end(), std::mem_fn(&Track::is_good))),
                       scene.n_beads());
  follow_neighbours(scene, parameters, tracks);
  return tracks;
}

int flag_outliers(const Scene& scene, double threshold, std::vector<Track>& tracks) {
  const std::vector<Motion> motions = motions_of(tracks);
  std::vector<char> is_outlier(tracks.size(), 0);
  for_each_bead(scene, [&](int k) {
    if (!tracks[k].is_good()) return;
    const auto local =
        local_motion(scene.position(k), good_around(scene, tracks, k, 12), scene.relaxed->positions, motions);
    const double misfit = local ? norm(motions[k].u - local->motion.u) : 0;
    // The floor is what a field's curvature within the reach may do without being wrong.
    is_outlier[k] = !local || local->n_beads < 3 ||
                    misfit > threshold * std::hypot(local->spread_px, tracks[k].found.sigma_px) + 0.3;
  });
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    if (is_outlier[k]) tracks[k].flag = "neighbours disagree";
  }
  return static_cast<int>(std::count(is_outlier.begin(), is_outlier.end(), 1));
}

void measure(const Scene& scene, double least_similarity, std::vector<Track>& tracks) {
  for_each_bead(scene, [&](int k) {
    Track& track = tracks[k];
    if (!track.is_good()) return;
    const Motion& guess = track.found.motion;
    const Registered measured =
        registered(scene.relaxed->image, scene.stressed.image.spline, scene.position(k), guess, scene.narrow);
    if (!measured.is_converged || norm(measured.motion.u - guess.u) > 2 * scene.bead_sigma()) {
      track.flag = "no partner";
      return;
    }
    track.found = measured;
  });
  flag_dissimilar(least_similarity, tracks);
  flag_changed_light(scene, tracks);
}

void verify(const Scene& scene, std::vector<Track>& tracks) {
  check_backwards(scene, tracks);
  check_claims(scene, tracks);
}

}  // namespace mbtfm::segment
