#include "segment/stacks/track.h"

#include <algorithm>
#include <cmath>

#include "pipeline/numerics/near.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::stacks {
namespace {

/// A third of a picture's light cut off leaves its flanks, from which the fit has the place.
constexpr double kSaturated = 1.0 / 3;

TrackFlag own_flag(const Spot& spot, const Detection& d) {
  const Widths w = d.shape.at(spot.place);
  const double x = std::min(spot.place.x, d.width - 1 - spot.place.x),
               y = std::min(spot.place.y, d.height - 1 - spot.place.y),
               z = std::min(spot.place.z, d.depth - 1 - spot.place.z);
  if (std::min(x, y) < w.xy || z < w.z) return TrackFlag::edge;
  if (spot.share_saturated > kSaturated) return TrackFlag::saturated;
  return TrackFlag::none;
}

void require_enough(std::size_t n, const char* which) {
  constexpr std::size_t kFewest = 40;
  if (n >= kFewest) return;
  throw beads::NotFollowed(std::string("the ") + which + " stack",
                           "40 beads or more: twenty neighbours of each, and as many at rest", std::to_string(n));
}

/// How far beads are from what their neighbours show: medians, so that what is wrong does not count. Strain that is no
/// affine map counts there. The ratio is over what standard errors explain, of the differences between beads and the
/// ones nearest to them, at no distance: the strain that the neighbours' affine map misses is the same for both there,
/// their errors are not.
struct Agreement {
  double across_um = 0, along_um = 0, ratio = 1, ratio_z = 1;
};

/// A difference between two beads, over what their errors explain.
struct Pair {
  double distance_um, over;
};
/// The median difference at no distance: what grows with its square between the nearer and the farther half is strain.
double median_at_no_distance(std::vector<Pair> pairs) {
  std::ranges::sort(pairs, {}, &Pair::distance_um);
  const auto half = pairs.begin() + std::ssize(pairs) / 2;
  const auto median_of = [](auto first, auto last, double Pair::*what) {
    std::vector<double> values;
    for (auto pair = first; pair != last; ++pair) values.push_back((*pair).*what);
    return numerics::median(values);
  };
  if (half == pairs.begin()) return median_of(pairs.begin(), pairs.end(), &Pair::over);
  const double near2 = std::pow(median_of(pairs.begin(), half, &Pair::over), 2),
               far2 = std::pow(median_of(half, pairs.end(), &Pair::over), 2),
               d2 = std::pow(median_of(pairs.begin(), half, &Pair::distance_um), 2),
               D2 = std::pow(median_of(half, pairs.end(), &Pair::distance_um), 2);
  if (!(D2 > d2)) return std::sqrt(near2);
  return std::sqrt(std::max(0.0, near2 - std::max(0.0, far2 - near2) * d2 / (D2 - d2)));
}
Agreement agreement_of(const std::vector<PlacedBead>& relaxed, const std::vector<PlacedBead>& stressed,
                       const std::vector<Match>& matches, double spacing_um) {
  std::vector<double> across, along;
  std::vector<Pair> over, over_z;
  std::vector<Vec3> places;
  std::vector<std::size_t> good;
  for (std::size_t k = 0; k < matches.size(); ++k) {
    const Match& m = matches[k];
    if (m.flag != TrackFlag::none) continue;
    across.push_back(std::hypot(m.from_neighbours_um.x, m.from_neighbours_um.y));
    along.push_back(std::abs(m.from_neighbours_um.z));
    good.push_back(k);
    places.push_back(relaxed[k].position_um);
  }
  if (across.empty()) return {};
  const auto own = [&](std::size_t k, double PlacedBead::*sigma) {
    return std::hypot(relaxed[k].*sigma, stressed[matches[k].partner].*sigma);
  };
  const numerics::Near near(places, spacing_um);
  for (std::size_t g = 0; g < good.size(); ++g) {
    for (const int other : near.within(places[g], spacing_um, 2)) {
      if (static_cast<std::size_t>(other) == g) continue;
      const std::size_t k = good[g], l = good[other];
      const Vec3 off = matches[k].from_neighbours_um - matches[l].from_neighbours_um;
      // each is among the other's neighbours, with the share by which these raise its error
      const double s = own(k, &PlacedBead::sigma_um), s_z = own(k, &PlacedBead::sigma_z_um);
      const double of_both = std::hypot(s, own(l, &PlacedBead::sigma_um)),
                   of_both_z = std::hypot(s_z, own(l, &PlacedBead::sigma_z_um));
      const double apart_um = norm(relaxed[k].position_um - relaxed[l].position_um);
      if (s > 0)
        over.push_back({apart_um, std::hypot(off.x, off.y) / (of_both * std::pow(matches[k].sigma_um / s, 2))});
      if (s_z > 0)
        over_z.push_back({apart_um, std::abs(off.z) / (of_both_z * std::pow(matches[k].sigma_z_um / s_z, 2))});
    }
  }
  // medians of a Rayleigh and of a folded normal variable
  constexpr double kRayleigh = 1.1774, kNormal = 0.6745;
  Agreement result{numerics::median(across) / kRayleigh, numerics::median(along) / kNormal};
  if (!over.empty()) result.ratio = median_at_no_distance(std::move(over)) / kRayleigh;
  if (!over_z.empty()) result.ratio_z = median_at_no_distance(std::move(over_z)) / kNormal;
  return result;
}

RigidMotion back(const RigidMotion& there) {
  return {.centre = there.centre + there.shift_um, .shift_um = -1 * there.shift_um, .turn_rad = -there.turn_rad};
}

TrackFlag flag_of(const std::vector<PlacedBead>& relaxed, const std::vector<PlacedBead>& stressed,
                  const Matching& matching, std::size_t k) {
  const Match& m = matching.matches[k];
  const TrackFlag own = relaxed[k].flag;
  if (m.partner < 0) return own != TrackFlag::none ? own : m.flag;
  if (m.flag != TrackFlag::none) return m.flag;
  return own != TrackFlag::none ? own : stressed[m.partner].flag;
}

/// In the frame of the relaxed stack: the turn and shift that begin the match are taken back.
Moved moved_bead(const std::vector<PlacedBead>& relaxed, const std::vector<PlacedBead>& stressed,
                 const Matching& matching, const Agreement& agreement, std::size_t k) {
  const double scale = std::max(1.0, agreement.ratio), scale_z = std::max(1.0, agreement.ratio_z);
  const PlacedBead& a = relaxed[k];
  const int partner = matching.matches[k].partner;
  if (partner < 0) return {a.position_um, {}, scale * a.sigma_um, scale_z * a.sigma_z_um};
  const PlacedBead& b = stressed[partner];
  return {a.position_um, back(matching.first).at(b.position_um) - a.position_um,
          scale * std::hypot(a.sigma_um, b.sigma_um), scale_z * std::hypot(a.sigma_z_um, b.sigma_z_um)};
}

/// Those that are followed, and not flagged.
std::vector<Moved> moved_beads(const std::vector<PlacedBead>& relaxed, const std::vector<PlacedBead>& stressed,
                               const Matching& matching, const Agreement& agreement) {
  std::vector<Moved> moved;
  for (std::size_t k = 0; k < relaxed.size(); ++k)
    if (flag_of(relaxed, stressed, matching, k) == TrackFlag::none)
      moved.push_back(moved_bead(relaxed, stressed, matching, agreement, k));
  if (moved.size() >= 40) return moved;
  throw beads::NotFollowed("the stressed stack", "40 of the relaxed stack's beads or more, displaced",
                           std::to_string(moved.size()) + " of " + std::to_string(relaxed.size()));
}

/// The stressed beads where they were without the drift of their slices, with its error in theirs.
std::vector<PlacedBead> without_drift(std::vector<PlacedBead> stressed, const RigidMotion& first,
                                      const CommonMotion& motion) {
  for (PlacedBead& bead : stressed) {
    const Vec3 place = back(first).at(bead.position_um);
    bead.sigma_um = std::hypot(bead.sigma_um, motion.drift_sigma_um_at(place.z));
    bead.position_um = first.at(place - motion.drift_um_at(place.z));
  }
  return stressed;
}

}  // namespace

void declare(stage::ParameterList& list, StackParameters& p) {
  list.table("track");
  list.add("dimensions", p.dimensions);
  list.add("z_step_um", p.z_step_um, Range::mesh_um());
  list.add("z_points", p.z_points);
  list.add("first_slice_z_um", p.first_slice_z_um, Range::between(-1e4, 1e4));
  list.add("refractive_index_ratio", p.refractive_index_ratio, Range::between(0.5, 2));
  list.add("slice_drift", p.slice_drift);
}

Vec3 Scale::place_um(Vec3 voxel) const {
  const double slice = z_points == ZPoints::into_gel ? voxel.z : depth - 1 - voxel.z;
  return {pixel_um * (voxel.x + 0.5), pixel_um * (voxel.y + 0.5), first_um + step_um * (slice + 0.5)};
}

std::vector<PlacedBead> placed(const Detection& detection, const Scale& scale) {
  std::vector<PlacedBead> beads;
  for (const Spot& spot : detection.spots) {
    beads.push_back({.position_um = scale.place_um(spot.place),
                     .brightness = spot.height,
                     .sigma_um = scale.pixel_um * spot.sigma,
                     .sigma_z_um = scale.step_um * spot.sigma_z,
                     .flag = own_flag(spot, detection)});
  }
  return beads;
}

Followed follow(const std::vector<PlacedBead>& relaxed, const std::vector<PlacedBead>& stressed,
                const MatchParameters& parameters, Switch slice_drift, const Slices& slices, int threads) {
  require_enough(relaxed.size(), "relaxed");
  require_enough(stressed.size(), "stressed");
  Matching matching = match(relaxed, stressed, parameters, threads);
  Agreement agreement = agreement_of(relaxed, stressed, matching.matches, matching.spacing_um);
  const CommonMotion drifted = common_motion(moved_beads(relaxed, stressed, matching, {}), slice_drift, slices);
  if (drifted.has_slice_drift) {
    // neighbours lie some slices off, and the stage has moved between: they are compared where it is taken back
    const std::vector<PlacedBead> steady = without_drift(stressed, matching.first, drifted);
    matching = match(relaxed, steady, parameters, threads);
    agreement = agreement_of(relaxed, steady, matching.matches, matching.spacing_um);
  }
  Followed result;
  result.first = matching.first;
  result.spacing_um = matching.spacing_um;
  result.n_stressed = static_cast<int>(stressed.size());
  result.neighbours_um = agreement.across_um, result.neighbours_z_um = agreement.along_um;
  result.error_ratio = agreement.ratio, result.error_ratio_z = agreement.ratio_z;
  const std::vector<Moved> moved = moved_beads(relaxed, stressed, matching, agreement);
  result.common = common_motion(moved, slice_drift, slices);
  result.n_good = static_cast<int>(moved.size());
  std::vector<double> light;
  for (std::size_t k = 0; k < relaxed.size(); ++k) {
    const TrackFlag flag = flag_of(relaxed, stressed, matching, k);
    const int partner = matching.matches[k].partner;
    const Moved bead = moved_bead(relaxed, stressed, matching, agreement, k);
    ++result.flags[name_of(flag)];
    result.field.push_back({.position_um = bead.place_um, .displacement_um = {}, .flag = name_of(flag)});
    BeadInSpace& entry = result.field.back();
    entry.sigma_um = std::hypot(bead.sigma_um, result.common.drift_sigma_um_at(bead.place_um.z));
    entry.sigma_z_um = bead.sigma_z_um;
    if (partner < 0) continue;
    entry.displacement_um = bead.displacement_um - result.common.at(bead.place_um);
    const double before = relaxed[k].brightness, after = stressed[partner].brightness;
    if (flag == TrackFlag::none && before > 0 && after > 0) light.push_back(after / before);
  }
  if (!light.empty()) result.light_ratio = numerics::median(light);
  return result;
}

}  // namespace mbtfm::stacks
