#include "segment/beads/measure.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "pipeline/numerics/order_statistics.h"
#include "segment/beads/follow.h"
#include "segment/beads/scene.h"

namespace mbtfm::beads {
namespace {

// Of a bead's width. Where beads scatter by a tenth of it, two of them differ by 0.4 widths at three standard
// deviations, which costs a window a twentieth of its likeness; with less, it is steepness or another bead that a
// dissimilar window shows.
constexpr double kLoose = 0.1;

bool is_inside(const Plane& plane, Vec2 place, double margin) {
  return place.x >= margin && place.y >= margin && place.x <= plane.width - 1 - margin &&
         place.y <= plane.height - 1 - margin;
}

struct Spots {
  std::vector<DetectedBead> beads;
  Neighbours near;
};

Neighbours sorted_places(const Scene& scene, const std::vector<DetectedBead>& beads) {
  std::vector<Vec2> places;
  for (const DetectedBead& bead : beads) places.push_back(bead.position_px);
  return {places, std::max(4.0, scene.spacing())};
}

/// How far off a bead's picture reaches into the narrow window: a spot ends at three sigmas.
double reach_of_others(const Scene& scene) { return 2 * scene.narrow.sigma + 3 * scene.bead_sigma(); }

/// The spots of these beads and all whose pictures reach into their windows.
std::vector<int> spots_around(const Scene& scene, const std::vector<DetectedBead>& spots, const Neighbours& near,
                              const std::vector<int>& beads) {
  std::vector<char> is_wanted(spots.size(), 0);
  for (const int bead : beads) {
    constexpr int kMost = 30;
    for (const int k : near.within(spots[bead].position_px, reach_of_others(scene), kMost)) is_wanted[k] = 1;
  }
  std::vector<int> result;
  for (std::size_t k = 0; k < spots.size(); ++k) {
    if (is_wanted[k]) result.push_back(static_cast<int>(k));
  }
  return result;
}

/// The beads in the stressed image as the tracks expect them, fitted together around the `wanted` ones: that two lie in
/// one blot is known from the relaxed image. Those of untracked beads have no height; the beads that no track leads to
/// come last.
Spots expected_spots(const Scene& scene, const std::vector<Track>& tracks, const std::vector<Motion>& motions,
                     const std::vector<int>& wanted) {
  std::vector<DetectedBead> spots;
  std::vector<Vec2> ends;
  for (int k = 0; k < scene.n_beads(); ++k) {
    const bool is_good = tracks[k].is_good();
    ends.push_back(scene.position(k) + (is_good ? motions[k].u : Vec2{}));
    spots.push_back({ends.back(), is_good ? scene.relaxed->beads[k].brightness : 0});
  }
  const Neighbours near(ends, std::max(4.0, scene.spacing()));
  for (const DetectedBead& bead : scene.stressed.beads) {
    const auto expected = near.within(bead.position_px, 2 * scene.bead_sigma(), 4);
    if (std::none_of(expected.begin(), expected.end(), [&](int k) { return tracks[k].is_good(); }))
      spots.push_back(bead);
  }
  std::vector<int> around = spots_around(scene, spots, sorted_places(scene, spots), wanted);
  constexpr int kRounds = 8;  // of half a pixel at most: from a loose bead's guess
  spots = fitted_spots(scene.stressed.image.plane, std::move(spots), std::move(around), scene.bead_sigma(), kRounds,
                       scene.threads);
  Neighbours places = sorted_places(scene, spots);
  return {std::move(spots), std::move(places)};
}

/// The beads around both ends of a track, less the bead itself.
Others others_around(const Scene& scene, int bead, const Spots& stressed) {
  const double reach = reach_of_others(scene);
  Others others{.in_reference = {}, .in_target = {}, .sigma = scene.bead_sigma()};
  const auto add = [&](const std::vector<DetectedBead>& beads, const Neighbours& near,
                       std::vector<Others::Spot>& spots) {
    for (const int k : near.within(beads[bead].position_px, reach, 20)) {
      if (k != bead && beads[k].brightness > 0) spots.push_back({beads[k].position_px, beads[k].brightness});
    }
  };
  add(scene.relaxed->beads, scene.relaxed->neighbours, others.in_reference);
  add(stressed.beads, stressed.near, others.in_target);
  return others;
}

/// A bead whose neighbours went elsewhere, or are in one image only, is measured without their pictures.
std::optional<Track> measured_alone(const Scene& scene, int bead, const Motion& guess, const Spots& stressed) {
  const Vec2 place = scene.position(bead);
  const Others others = others_around(scene, bead, stressed);
  Motion there = guess;
  there.u = stressed.beads[bead].position_px - place;
  if (norm(there.u - guess.u) > 3 * scene.bead_sigma()) return std::nullopt;
  const Registered found =
      registered(scene.relaxed->image, scene.stressed.image.spline, place, there, scene.narrow, others);
  if (!found.is_converged || norm(found.motion.u - there.u) > scene.bead_sigma()) return std::nullopt;
  return Track{.found = found, .flag = TrackFlag::none, .others = others};
}

/// How far the picture's beads are from looking the same in both images.
struct Dissimilarity {
  double median = 0;
  double noise = 0;      ///< standard deviation of a pixel
  double granted = 0.4;  ///< whatever the reason
  /// What similarity a right match has depends on the noise, so the picture itself sets it: a bead that is less similar
  /// by eight times the median lack of it shows another bead. Steep places cost similarity too: a tenth is granted.
  /// A dim bead lacks more, noise²/variance; it may lack half more than that. Of a bead `alone`, which any other may
  /// be taken for, twice as much is asked.
  bool is_same(const Track& track) const {
    const double share = track.others ? 0.5 : 1;
    const double by_noise = 1.5 * noise * noise / std::max(track.found.variance, 1e-12);
    return 1 - track.found.similarity <= std::min(std::max(share * std::max(0.1, 8 * median), by_noise), granted);
  }
};

Dissimilarity dissimilarity(const Scene& scene, double least_similarity, const std::vector<Track>& tracks) {
  std::vector<double> lacks;
  for (const Track& track : tracks) {
    if (track.is_good()) lacks.push_back(1 - track.found.similarity);
  }
  return {.median = numerics::quantile(std::move(lacks), 0.5),
          .noise = std::hypot(scene.relaxed->noise, scene.stressed.noise) / std::sqrt(2.0),
          .granted = 1 - least_similarity};
}

/// Where the narrow window loses the bead, or finds another, it has no likeness.
void measure_narrowly(const Scene& scene, std::vector<Track>& tracks) {
  for_each_bead(scene, [&](int k) {
    Track& track = tracks[k];
    if (!track.is_good()) return;
    const Registered found = registered(scene.relaxed->image, scene.stressed.image.spline, scene.position(k),
                                        track.found.motion, scene.narrow);
    const bool is_near = norm(found.motion.u - track.found.motion.u) < 2 * scene.bead_sigma();
    track.found.similarity = -1;
    if (found.is_converged && is_near) track.found = found;
  });
}

/// Where beads are loose, windows less alike than most may be spoilt by beads that went elsewhere: those are measured
/// without them, and the more similar answer counts.
void look_again(const Scene& scene, const Dissimilarity& allowed, const std::vector<Motion>& guesses,
                std::vector<Track>& tracks) {
  constexpr double kNoMatter = 0.05;  // half of what steepness alone is granted
  const auto is_spoilt = [&](const Track& track) {
    return track.is_good() && 1 - track.found.similarity > std::max(kNoMatter, 2 * allowed.median);
  };
  if (typical_spread(motions_around(scene, tracks)) < kLoose * scene.bead_sigma()) return;
  std::vector<Motion> starts = motions_of(tracks);
  std::vector<int> spoilt;
  for (int k = 0; k < scene.n_beads(); ++k) {
    if (!is_spoilt(tracks[k])) continue;
    starts[k] = guesses[k];
    spoilt.push_back(k);
  }
  const Spots stressed = expected_spots(scene, tracks, starts, spoilt);
  for_each_bead(scene, [&](int k) {
    if (!is_spoilt(tracks[k])) return;
    auto alone = measured_alone(scene, k, guesses[k], stressed);
    if (!alone || alone->found.similarity <= tracks[k].found.similarity || !allowed.is_same(*alone)) return;
    tracks[k] = std::move(*alone);
  });
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
    deviation[k] = std::abs(std::log(found.gain) - numerics::quantile(std::move(around), 0.5)) / error;
  });
  std::vector<double> sizes;
  for (const double size : deviation) {
    if (size > 0) sizes.push_back(size);
  }
  const double most = kMost * numerics::quantile(std::move(sizes), 0.5) / 0.6745;
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    if (tracks[k].is_good() && deviation[k] > most) tracks[k].flag = TrackFlag::ambiguous;
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
  Window with_error = window;
  window.states_error = false;
  for_each_bead(scene, [&](int k) {
    Track& track = tracks[k];
    if (!track.is_good()) return;
    const Motion& forward = track.found.motion;
    const Vec2 there = scene.position(k) + forward.u;
    if (!is_inside(scene.stressed.image.plane, there, 2 * scene.bead_sigma())) {
      track.flag = TrackFlag::edge;
      return;
    }
    const auto back = inverse(forward);
    if (!back) {
      track.flag = TrackFlag::ambiguous;
      return;
    }
    Others others = track.others.value_or(Others{});
    std::swap(others.in_reference, others.in_target);
    const auto returned = [&](const Window& by) {
      return registered(scene.stressed.image, scene.relaxed->image.spline, there, *back, by, others);
    };
    const double missed = norm(returned(window).motion.u + forward.u);
    const double granted = 0.5 + 4 * track.found.sigma_px;
    if (missed > granted) {  // then the way back's own error, too, is granted
      const double sigma = std::hypot(track.found.sigma_px, returned(with_error).sigma_px);
      if (missed > 0.5 + 4 * sigma) track.flag = TrackFlag::ambiguous;
    }
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
    if (is_taken[k]) tracks[k].flag = TrackFlag::ambiguous;
  }
}

/// Where the beads around miss the expected motion by a third of what beads scatter by or more, a window may have taken
/// a neighbour's picture, and neighbours are no witnesses of it: such beads are matched anew, too.
/// @param beside  motions_around() with what is expected
std::vector<Track> without_doubtful(const Scene& scene, std::vector<Track> tracks, double scatter_px,
                                    const std::vector<std::optional<LocalMotion>>& beside) {
  constexpr double kDoubtful = 0.3;  // 0.1 finds as many; to doubt all of them finds fewer
  const std::vector<double> missed_px = missed_around(scene, tracks, beside);
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    if (tracks[k].is_good() && missed_px[k] > kDoubtful * scatter_px) tracks[k].flag = TrackFlag::no_partner;
  }
  return tracks;
}

}  // namespace

void measure(const Scene& scene, double least_similarity, std::vector<Track>& tracks) {
  const std::vector<Motion> guesses = motions_of(tracks);
  measure_narrowly(scene, tracks);
  const Dissimilarity allowed = dissimilarity(scene, least_similarity, tracks);
  look_again(scene, allowed, guesses, tracks);
  for (Track& track : tracks) {
    if (track.is_good() && !allowed.is_same(track)) track.flag = TrackFlag::no_partner;
  }
  flag_changed_light(scene, tracks);
}

void recover(const Scene& scene, double least_similarity, std::vector<Track>& tracks,
             const std::vector<Vec2>& expected) {
  const auto beside = motions_around(scene, tracks, expected);
  const double scatter = typical_spread(beside);
  if (scatter < kLoose * scene.bead_sigma()) return;
  auto spots = matched_spots(scene, expected.empty() ? tracks : without_doubtful(scene, tracks, scatter, beside),
                             scatter, expected);
  std::vector<Track> all = tracks;
  std::vector<Motion> starts = motions_of(tracks);
  std::vector<int> matched;
  for (int k = 0; k < scene.n_beads(); ++k) {
    if (!spots[k]) continue;
    const Vec2 step = scene.stressed.positions[*spots[k]] - scene.position(k);
    if (tracks[k].is_good() && norm(tracks[k].found.motion.u - step) < scene.bead_sigma()) {
      spots[k].reset();  // it is there already
      continue;
    }
    // a bead keeps its shape, however steep the field
    starts[k] = {.u = step};
    all[k].flag = TrackFlag::none;
    matched.push_back(k);
  }
  const Spots stressed = expected_spots(scene, all, starts, matched);
  const Dissimilarity allowed = dissimilarity(scene, least_similarity, tracks);
  std::vector<Track> found(tracks.size());
  for_each_bead(scene, [&](int k) {
    if (!spots[k]) return;
    auto alone = measured_alone(scene, k, starts[k], stressed);
    if (alone && allowed.is_same(*alone)) found[k] = std::move(*alone);
  });
  check_backwards(scene, found);
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    if (found[k].is_good()) {
      tracks[k] = std::move(found[k]);
    } else if (spots[k] && tracks[k].is_good()) {
      tracks[k].flag = TrackFlag::ambiguous;
    }
  }
  flag_changed_light(scene, tracks);
  check_claims(scene, tracks);
}

void verify(const Scene& scene, std::vector<Track>& tracks) {
  check_backwards(scene, tracks);
  check_claims(scene, tracks);
}

}  // namespace mbtfm::beads
