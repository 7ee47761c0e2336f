#include "segment/track.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/parallel.h"
#include "segment/beads.h"
#include "segment/coarse_field.h"
#include "segment/far_field.h"
#include "segment/local_motion.h"
#include "segment/registration.h"

namespace mbtfm::segment {
namespace {

/// Both images made ready, and the sizes that everything follows from.
struct Scene {
  Reference relaxed, stressed;
  double bead_sigma = 0;
  double noise = 0;    ///< of the difference of two pixels
  double spacing = 0;  ///< mean distance of beads: 1/sqrt(density)
  std::vector<DetectedBead> beads, beads_stressed;
  std::vector<Vec2> positions, positions_stressed;
  Window wide;  ///< the window that finds a bead: about three beads weigh in it
  int threads = 1;
};

/// A bead's track; it counts once `flag` is empty.
struct Track {
  Registered wide, chosen;
  std::string flag = "not found";
  bool is_good() const { return flag.empty(); }
};

std::vector<Vec2> positions_of(const std::vector<DetectedBead>& beads) {
  std::vector<Vec2> result;
  for (const DetectedBead& bead : beads) result.push_back(bead.position_px);
  return result;
}

Scene prepare(const Image& relaxed, const Image& stressed, const TrackParameters& parameters, int threads) {
  Scene scene;
  scene.threads = threads;
  const double rough_background = 12;  // px: six sigmas of an ordinary bead; set from the bead itself below
  scene.bead_sigma = bead_sigma_of(without_background(relaxed, rough_background));
  const auto no_beads = [](const char* which) {
    return InvalidData(std::string("the ") + which + " image", "bright beads on a darker ground", "none");
  };
  if (!(scene.bead_sigma > 0)) throw no_beads("relaxed");
  const double background = background_sigma(scene.bead_sigma);
  scene.relaxed = with_slopes(without_background(relaxed, background));
  scene.stressed = with_slopes(without_background(stressed, background));
  const double noise_relaxed = noise_of(scene.relaxed.plane), noise_stressed = noise_of(scene.stressed.plane);
  scene.noise = std::hypot(noise_relaxed, noise_stressed);
  scene.beads = find_spots(scene.relaxed.plane, scene.bead_sigma, noise_relaxed, parameters.detection_snr, threads);
  scene.beads_stressed =
      find_spots(scene.stressed.plane, scene.bead_sigma, noise_stressed, parameters.detection_snr, threads);
  constexpr std::size_t kFewest = 8;  // an affine map and a scatter about it take six beads
  if (scene.beads.size() < kFewest) throw no_beads("relaxed");
  if (scene.beads_stressed.size() < kFewest) throw no_beads("stressed");
  scene.positions = positions_of(scene.beads);
  scene.positions_stressed = positions_of(scene.beads_stressed);
  const double n_beads = static_cast<double>(scene.beads.size());
  scene.spacing = std::sqrt(relaxed.width * static_cast<double>(relaxed.height) / n_beads);
  // A Gaussian weight of sigma s weighs the area 4 pi s²: three beads in it.
  const double three_beads = scene.spacing * std::sqrt(0.75 / std::numbers::pi);
  scene.wide = {.sigma = std::clamp(three_beads, 3.5 * scene.bead_sigma, 5 * scene.bead_sigma),
                .gradient_sd = 0.3,
                .noise = 2 * scene.noise,
                .max_steps = 15};
  return scene;
}

template <class Body>
void for_each_bead(const Scene& scene, const Body& body) {
  constexpr int kChunk = 32;
  const int n = static_cast<int>(scene.beads.size());
  parallel_for((n + kChunk - 1) / kChunk, scene.threads, [&](int chunk) {
    for (int k = chunk * kChunk; k < std::min(n, (chunk + 1) * kChunk); ++k) body(k);
  });
}

bool is_inside(const Plane& plane, Vec2 place, double margin) {
  return place.x >= margin && place.y >= margin && place.x <= plane.width - 1 - margin &&
         place.y <= plane.height - 1 - margin;
}

/// The good tracks around a place, without the bead itself.
std::vector<int> good_around(const Scene& scene, const Neighbours& neighbours, const std::vector<Track>& tracks,
                             int bead, int n) {
  std::vector<int> result;
  for (const int k : neighbours.within(scene.positions[bead], 3.5 * scene.spacing, 3 * n)) {
    if (k != bead && tracks[k].is_good() && static_cast<int>(result.size()) < n) result.push_back(k);
  }
  return result;
}

std::vector<Motion> motions_of(const std::vector<Track>& tracks, bool is_chosen) {
  std::vector<Motion> result;
  for (const Track& track : tracks) result.push_back(is_chosen ? track.chosen.motion : track.wide.motion);
  return result;
}

/// First round: from the grid.
void follow_grid(const Scene& scene, const GridField& grid, double least_similarity, std::vector<Track>& tracks) {
  for_each_bead(scene, [&](int k) {
    Track& track = tracks[k];
    const Motion guess = grid.at(scene.positions[k]);
    track.wide = registered(scene.relaxed, scene.stressed.plane, scene.positions[k], guess, scene.wide);
    const double moved = norm(track.wide.motion.u - guess.u);
    // further than two bead widths from the guess a registration has caught another bead
    if (track.wide.is_converged && track.wide.similarity > least_similarity && moved < 4 * scene.bead_sigma) {
      track.flag.clear();
    }
  });
}

/// Take the flagless mark from tracks that contradict those around them.
int reject_outliers(const Scene& scene, const Neighbours& neighbours, double threshold, bool is_chosen,
                    std::vector<Track>& tracks) {
  const std::vector<Motion> motions = motions_of(tracks, is_chosen);
  std::vector<char> is_outlier(tracks.size(), 0);
  for_each_bead(scene, [&](int k) {
    if (!tracks[k].is_good()) return;
    const auto local =
        local_motion(scene.positions[k], good_around(scene, neighbours, tracks, k, 12), scene.positions, motions);
    const double misfit = local ? norm(motions[k].u - local->motion.u) : 0;
    const double own = is_chosen ? tracks[k].chosen.sigma_px : tracks[k].wide.sigma_px;
    // The floor is what a field's curvature within the reach may do without being wrong.
    is_outlier[k] = !local || local->n_beads < 3 || misfit > threshold * std::hypot(local->spread_px, own) + 0.3;
  });
  int n_rejected = 0;
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    if (!is_outlier[k]) continue;
    tracks[k].flag = "differs from its neighbours";
    ++n_rejected;
  }
  return n_rejected;
}

/// A track of bead k from what its neighbours do: their affine motion itself, and the stressed image's beads near where
/// it leads; the most similar counts.
std::optional<Registered> retried(const Scene& scene, const Neighbours& neighbours, const Neighbours& stressed,
                                  const std::vector<Track>& tracks, const std::vector<Motion>& motions, int k,
                                  double least_similarity) {
  const Vec2 place = scene.positions[k];
  const auto local = local_motion(place, good_around(scene, neighbours, tracks, k, 8), scene.positions, motions);
  if (!local || local->n_beads < 3) return std::nullopt;
  std::vector<Motion> guesses = {local->motion};
  const double search = std::clamp(4 * local->spread_px, 2 * scene.bead_sigma, 5 * scene.bead_sigma);
  for (const int b : stressed.within(place + local->motion.u, search, 4)) {
    guesses.push_back(local->motion);
    guesses.back().u = scene.positions_stressed[b] - place;
  }
  Window window = scene.wide;
  window.sigma = std::max(2.2 * scene.bead_sigma, 0.6 * scene.wide.sigma);
  std::optional<Registered> best;
  for (const Motion& guess : guesses) {
    const Registered found = registered(scene.relaxed, scene.stressed.plane, place, guess, window);
    if (!found.is_converged || norm(found.motion.u - local->motion.u) > search) continue;
    if (found.similarity > std::max(least_similarity, best ? best->similarity : -1)) best = found;
  }
  return best;
}

void follow_neighbours(const Scene& scene, const Neighbours& neighbours, const TrackParameters& parameters,
                       std::vector<Track>& tracks) {
  const Neighbours stressed(scene.positions_stressed, std::max(4.0, scene.spacing));
  constexpr int kMaxRounds = 12;
  for (int round = 0; round < kMaxRounds; ++round) {
    const std::vector<Motion> motions = motions_of(tracks, false);
    std::vector<std::optional<Registered>> found(tracks.size());
    for_each_bead(scene, [&](int k) {
      if (tracks[k].is_good()) return;
      // a narrow window may take a stranger for the bead: more is asked of it
      found[k] = retried(scene, neighbours, stressed, tracks, motions, k, 0.5 * (1 + parameters.least_similarity));
    });
    int n_found = 0;
    for (std::size_t k = 0; k < tracks.size(); ++k) {
      if (!found[k]) continue;
      tracks[k].wide = *found[k];
      tracks[k].flag.clear();
      ++n_found;
    }
    const int n_rejected = reject_outliers(scene, neighbours, parameters.outlier_threshold, false, tracks);
    if (n_found <= n_rejected) break;
  }
}

/// The widest window whose displacement agrees with those of all narrower ones; no wider than needed for a standard
/// error that is small against what a field is used for, so that beads keep errors of their own.
Registered chosen_window(const Scene& scene, Vec2 place, const Registered& wide) {
  constexpr double kAgree = 1.0;        // each interval: ± 1 standard error; more lets a window's bias pass for noise
  constexpr double kFineEnough = 0.02;  // px
  constexpr double kNarrowest = 1.6, kGrowth = 1.45;  // of a bead's sigma
  constexpr int kWindows = 6;
  Vec2 low{-1e9, -1e9}, high{1e9, 1e9};
  Registered best, narrowest;
  Window window = scene.wide;
  window.gradient_sd = 0.15;
  window.sigma = kNarrowest * scene.bead_sigma;
  for (int k = 0; k < kWindows; ++k, window.sigma *= kGrowth) {
    const Motion& guess = best.is_converged ? best.motion : wide.motion;
    const Registered next = registered(scene.relaxed, scene.stressed.plane, place, guess, window);
    if (!next.is_converged || norm(next.motion.u - wide.motion.u) > 2 * scene.bead_sigma) continue;
    const double half = kAgree * next.sigma_px;
    low = {std::max(low.x, next.motion.u.x - half), std::max(low.y, next.motion.u.y - half)};
    high = {std::min(high.x, next.motion.u.x + half), std::min(high.y, next.motion.u.y + half)};
    if (best.is_converged && (low.x > high.x || low.y > high.y)) break;
    best = next;
    if (!narrowest.is_converged) narrowest = next;
    if (best.sigma_px < kFineEnough) break;
  }
  // What the chosen window differs from the narrowest by, beyond what noise explains, is its bias: part of its error.
  const Vec2 apart = best.motion.u - narrowest.motion.u;
  const double by_noise = narrowest.sigma_px * narrowest.sigma_px - best.sigma_px * best.sigma_px;
  best.sigma_px = std::sqrt(best.sigma_px * best.sigma_px + std::max(0.0, 0.5 * dot(apart, apart) - by_noise));
  return best;
}

void choose_windows(const Scene& scene, const TrackParameters& parameters, std::vector<Track>& tracks) {
  for_each_bead(scene, [&](int k) {
    Track& track = tracks[k];
    if (!track.is_good()) return;
    track.chosen = chosen_window(scene, scene.positions[k], track.wide);
    if (track.chosen.is_converged) return;
    track.flag = "poor match";
    track.chosen = track.wide;
  });
  // What similarity a right match has depends on the noise, so the picture itself tells: a bead that is less similar
  // by eight times the median lack of it shows another bead. Steep places cost similarity too: a tenth is granted.
  std::vector<double> lacks;
  for (const Track& track : tracks) {
    if (track.is_good()) lacks.push_back(1 - track.chosen.similarity);
  }
  const double most = std::min(std::max(0.1, 8 * quantile(std::move(lacks), 0.5)), 1 - parameters.least_similarity);
  for (Track& track : tracks) {
    if (track.is_good() && 1 - track.chosen.similarity > most) track.flag = "poor match";
  }
}

/// Registered from where it went, a bead must come back to where it was.
void check_backwards(const Scene& scene, std::vector<Track>& tracks) {
  Window window = scene.wide;
  window.sigma = std::max(1.9 * scene.bead_sigma, 0.6 * scene.wide.sigma);
  window.max_steps = 6;
  for_each_bead(scene, [&](int k) {
    Track& track = tracks[k];
    if (!track.is_good()) return;
    const Motion& forward = track.chosen.motion;
    const Vec2 there = scene.positions[k] + forward.u;
    if (!is_inside(scene.stressed.plane, there, 2 * scene.bead_sigma)) {
      track.flag = "at the border";
      return;
    }
    const double xx = 1 + forward.ux_x, yy = 1 + forward.uy_y, xy = forward.ux_y, yx = forward.uy_x;
    const double determinant = xx * yy - xy * yx;
    if (!(determinant > 0.1)) {
      track.flag = "folds the surface";
      return;
    }
    const Motion back{-1 * forward.u, yy / determinant - 1, -xy / determinant, -yx / determinant, xx / determinant - 1};
    const Registered returned = registered(scene.stressed, scene.relaxed.plane, there, back, window);
    const double missed = norm(returned.motion.u + forward.u);
    const double allowed = 0.5 + 4 * std::hypot(track.chosen.sigma_px, returned.sigma_px);
    if (missed > allowed) track.flag = "does not come back";
  });
}

/// Two beads cannot go to one place: the less similar one is wrong.
void check_claims(const Scene& scene, std::vector<Track>& tracks) {
  std::vector<Vec2> ends;
  for (std::size_t k = 0; k < tracks.size(); ++k) ends.push_back(scene.positions[k] + tracks[k].chosen.motion.u);
  const Neighbours neighbours(ends, std::max(4.0, scene.spacing));
  std::vector<char> is_taken(tracks.size(), 0);
  for_each_bead(scene, [&](int k) {
    if (!tracks[k].is_good()) return;
    for (const int other : neighbours.within(ends[k], 0.6 * scene.bead_sigma, 6)) {
      if (other == k || !tracks[other].is_good()) continue;
      const double before = norm(scene.positions[k] - scene.positions[other]);
      if (before < 1.5 * scene.bead_sigma) continue;  // they were one blot before
      const double mine = tracks[k].chosen.similarity, theirs = tracks[other].chosen.similarity;
      if (mine < theirs || (mine == theirs && k > other)) is_taken[k] = 1;
    }
  });
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    if (is_taken[k]) tracks[k].flag = "goes where another bead goes";
  }
}

/// Standard deviation (px) that single beads have beyond the errors of their registration: beads that sit loose, at
/// other depths or on others' flanks. From each bead's misfit to the affine motion of its neighbours: the s for which
/// the median of misfit² / (sigma² + s²) is that of a two-dimensional normal variable, ln 2 a component pair's mean
/// square.
double scatter_beyond_noise(const Scene& scene, const Neighbours& neighbours, const std::vector<Track>& tracks) {
  const std::vector<Motion> motions = motions_of(tracks, true);
  std::vector<double> misfits(tracks.size(), -1);
  for_each_bead(scene, [&](int k) {
    if (!tracks[k].is_good()) return;
    const auto local =
        local_motion(scene.positions[k], good_around(scene, neighbours, tracks, k, 12), scene.positions, motions);
    if (!local || local->n_beads < 8) return;
    const Vec2 misfit = motions[k].u - local->motion.u;
    misfits[k] = 0.5 * dot(misfit, misfit);
  });
  constexpr double kNeighbours = 1 + 1.0 / 8;  // the fit's own variance: its weights leave eight beads of twelve
  const auto median_ratio = [&](double scatter) {
    std::vector<double> ratios;
    for (std::size_t k = 0; k < tracks.size(); ++k) {
      const double variance = tracks[k].chosen.sigma_px * tracks[k].chosen.sigma_px + scatter * scatter;
      if (misfits[k] >= 0 && variance > 0) ratios.push_back(misfits[k] / (kNeighbours * variance));
    }
    return quantile(std::move(ratios), 0.5);
  };
  double low = 0, high = 10;
  if (median_ratio(low) <= std::numbers::ln2) return 0;
  for (int step = 0; step < 30; ++step) {
    const double middle = 0.5 * (low + high);
    (median_ratio(middle) > std::numbers::ln2 ? low : high) = middle;
  }
  return high;
}

FarField far_field_of(const Scene& scene, const std::vector<Track>& tracks, double share) {
  std::vector<Vec2> positions, displacements;
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    if (!tracks[k].is_good()) continue;
    positions.push_back(scene.positions[k]);
    displacements.push_back(tracks[k].chosen.motion.u);
  }
  const Plane& plane = scene.relaxed.plane;
  return far_field(positions, displacements, plane.width, plane.height, share * std::min(plane.width, plane.height));
}

int search_window(const Scene& scene, const TrackParameters& parameters, double pixel_size_um) {
  // sixteen beads make the right peak stand out; shifts are found up to half a window
  double needed = std::max(64.0, 4 * scene.spacing);
  if (parameters.largest_displacement_um > 0) {
    needed = std::max(needed, 2.2 * parameters.largest_displacement_um / pixel_size_um);
  }
  int window = 32;
  while (window < needed) window *= 2;
  return window;
}

}  // namespace

void declare(ParameterList& list, TrackParameters& p) {
  list.table("");
  list.add("pixel_size_um", p.pixel_size_um, Range::positive(),
           "side of a pixel in the specimen (um); unset: from the image's own calibration");
  list.table("track");
  list.add("stressed_page", p.stressed_page, {.low = 1}, "page of the stressed bead image to read, from 1");
  list.add("relaxed_page", p.relaxed_page, {.low = 1}, "page of the relaxed bead image to read, from 1");
  list.add("detection_snr", p.detection_snr, Range::positive(),
           "height of a bead over the noise (standard deviations)");
  list.add("largest_displacement_um", p.largest_displacement_um, Range::not_negative(),
           "how far to look for a bead, after the drift (um); 0: 32 pixels, further where beads are sparse");
  list.add(
      "far_field_share", p.far_field_share, Range::between(0.01, 0.5),
      "width of the frame along the border that is taken for far from the cell, for the drift (share of the side)");
  list.add("least_similarity", p.least_similarity, Range::between(0, 1),
           "least correlation of a bead's surroundings in both images");
  list.add("outlier_threshold", p.outlier_threshold, Range::positive(),
           "difference from the neighbours that flags a bead (robust standard deviations)");
}

Tracking track_beads(const Image& relaxed, const Image& stressed, double pixel_size_um,
                     const TrackParameters& parameters, int threads, const Progress& progress) {
  const auto tell = [&](double fraction, const char* what) {
    if (progress) progress(fraction, what);
  };
  if (relaxed.width != stressed.width || relaxed.height != stressed.height) {
    throw InvalidData(
        "the stressed image",
        "the relaxed image's " + std::to_string(relaxed.width) + " x " + std::to_string(relaxed.height) + " pixels",
        std::to_string(stressed.width) + " x " + std::to_string(stressed.height));
  }
  tell(0, "finding beads");
  const Scene scene = prepare(relaxed, stressed, parameters, threads);
  tell(0.2, "correlating windows");
  const Vec2 shift = drift_of(scene.relaxed.plane, scene.stressed.plane);
  const GridField grid = coarse_field(scene.relaxed.plane, scene.stressed.plane, shift,
                                      search_window(scene, parameters, pixel_size_um), threads);
  tell(0.3, "registering beads");
  const Neighbours neighbours(scene.positions, std::max(4.0, scene.spacing));
  std::vector<Track> tracks(scene.beads.size());
  follow_grid(scene, grid, parameters.least_similarity, tracks);
  reject_outliers(scene, neighbours, parameters.outlier_threshold, false, tracks);
  tell(0.5, "following neighbours");
  follow_neighbours(scene, neighbours, parameters, tracks);
  tell(0.6, "choosing windows");
  choose_windows(scene, parameters, tracks);
  tell(0.8, "checking backwards");
  check_backwards(scene, tracks);
  check_claims(scene, tracks);
  reject_outliers(scene, neighbours, parameters.outlier_threshold, true, tracks);

  Tracking result;
  const FarField far = far_field_of(scene, tracks, parameters.far_field_share);
  result.drift_um = pixel_size_um * far.drift;
  result.far_field_rms_um = pixel_size_um * far.rms;
  const double scatter = scatter_beyond_noise(scene, neighbours, tracks);
  result.scatter_um = pixel_size_um * scatter;
  result.has_far_field = far.is_at_rest;
  result.bead_sigma_um = pixel_size_um * scene.bead_sigma;
  result.n_beads_stressed = static_cast<int>(scene.beads_stressed.size());
  for (std::size_t k = 0; k < tracks.size(); ++k) {
    const Registered& found = tracks[k].flag == "not found" ? tracks[k].wide : tracks[k].chosen;
    Bead bead;
    bead.position_um = pixel_size_um * (scene.positions[k] + Vec2{0.5, 0.5});
    bead.displacement_um = pixel_size_um * (found.motion.u - far.drift);
    bead.sigma_um = pixel_size_um * std::hypot(found.sigma_px, scatter);
    bead.flag = tracks[k].flag;
    if (bead.flag.empty()) ++result.n_good;
    result.field.push_back(bead);
  }
  return result;
}

}  // namespace mbtfm::segment
