#include "mbtfm/mean/registration.h"

#include <Eigen/Core>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/parsed.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::mean {

namespace {

constexpr int kAngles = 72;  // at which the misfit is looked at first: outlines of up to some 18 spikes
constexpr int kCoarsePoints = 90;
constexpr double kWorthRefining = 1.5,
                 kCoarseMisfit = 0.02;  // misfit of few points; what their chords leave, of the size
constexpr int kFinePoints = 300;        // of an outline of 100 um: a point each micrometre

/// Points at equal distances along the closed line.
Polygon resampled(const Polygon& polygon, int n) {
  std::vector<double> along = {0};
  for (std::size_t k = 0; k < polygon.size(); ++k)
    along.push_back(along.back() + norm(polygon[(k + 1) % polygon.size()] - polygon[k]));
  Polygon points;
  std::size_t piece = 0;
  for (int k = 0; k < n; ++k) {
    const double at = along.back() * k / n;
    while (along[piece + 1] <= at && piece + 1 < polygon.size()) ++piece;
    const double length = along[piece + 1] - along[piece];
    const double share = length > 0 ? (at - along[piece]) / length : 0;
    points.push_back((1 - share) * polygon[piece] + share * polygon[(piece + 1) % polygon.size()]);
  }
  return points;
}

/// A point of the moved outline, the point of the reference that it belongs to, and the way from there.
struct Pair {
  Vec2 moved, way;
};

/// Each outline's points with the nearest ones of the other.
std::vector<Pair> pairs_of(const Polygon& moved_outline, const Polygon& reference) {
  std::vector<Pair> pairs;
  for (const Vec2 p : moved_outline) pairs.push_back({p, p - nearest_on_boundary_um(reference, p)});
  for (const Vec2 q : reference) {
    const Vec2 seen = nearest_on_boundary_um(moved_outline, q);
    pairs.push_back({seen, seen - q});
  }
  return pairs;
}

double mean_square(const std::vector<Pair>& pairs) {
  double sum = 0;
  for (const Pair& pair : pairs) sum += dot(pair.way, pair.way);
  return sum / static_cast<double>(pairs.size());
}

struct Normal {
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();
  Eigen::Vector3d slope = Eigen::Vector3d::Zero();
};
/// Of the distances by shift and turn about the place that the motion leads to.
Normal normal_of(const std::vector<Pair>& pairs, Vec2 centre, double size) {
  Normal normal;
  for (const Pair& pair : pairs) {
    const double distance = norm(pair.way);
    if (distance == 0) continue;
    const Vec2 n = (1 / distance) * pair.way, arm = pair.moved - centre;
    const Eigen::Vector3d by(n.x, n.y, cross(arm, n));
    normal.matrix += by * by.transpose();
    normal.slope += distance * by;
  }
  // a circle does not show its angle: leave it
  constexpr double kHold = 1e-9;
  const double weight = kHold * static_cast<double>(pairs.size());
  normal.matrix += Eigen::Vector3d(weight, weight, weight * size * size).asDiagonal();
  return normal;
}

/// How many of n points in a row lie independently: n over one plus twice the sum of their correlations.
double independent(const std::vector<double>& values) {
  const std::size_t n = values.size();
  double square = 0;
  for (const double v : values) square += v * v;
  if (!(square > 0)) return static_cast<double>(n);
  double sum = 1;
  for (std::size_t lag = 1; lag < n / 2; ++lag) {
    double product = 0;
    for (std::size_t k = 0; k < n; ++k) product += values[k] * values[(k + lag) % n];
    if (product <= 0) break;
    sum += 2 * product / square;
  }
  return std::max(4.0, static_cast<double>(n) / sum);
}

/// Distances of the outline's points from the reference, negative inside.
std::vector<double> signed_distances(const Polygon& outline, const Polygon& reference) {
  std::vector<double> distances;
  for (const Vec2 p : outline)
    distances.push_back((contains(reference, p) ? -1 : 1) * distance_to_boundary_um(reference, p));
  return distances;
}

/// To the least misfit near a motion.
Way refined(const Polygon& outline, const Polygon& reference, Motion motion) {
  constexpr int kMostSteps = 200, kMostHalvings = 12;
  constexpr double kStill = 1e-9;  // of the size
  const double size = size_um(reference);
  std::vector<Pair> pairs = pairs_of(moved(outline, motion), reference);
  double now = mean_square(pairs);
  for (int step = 0; step < kMostSteps; ++step) {
    const Normal normal = normal_of(pairs, motion.to_um, size);
    const Eigen::Vector3d change = -numerics::solve_symmetric(normal.matrix, normal.slope);
    double length = 1;
    bool is_better = false;
    for (int halving = 0; halving < kMostHalvings && !is_better; ++halving, length /= 2) {
      Motion next = motion;
      next.to_um += {length * change[0], length * change[1]};
      next.angle_rad += length * change[2];
      std::vector<Pair> there = pairs_of(moved(outline, next), reference);
      const double value = mean_square(there);
      if (value >= now) continue;
      is_better = true;
      motion = next;
      pairs = std::move(there);
      now = value;
    }
    if (!is_better || std::max(std::hypot(change[0], change[1]) / size, std::abs(change[2])) < kStill) break;
  }
  const std::vector<double> distances = signed_distances(moved(outline, motion), reference);
  const double share = static_cast<double>(pairs.size()) / independent(distances);
  const Eigen::Matrix3d covariance = now * share * normal_of(pairs, motion.to_um, size).matrix.inverse();
  motion.angle_rad = std::remainder(motion.angle_rad, 2 * std::numbers::pi);
  return {motion, std::sqrt(now), std::sqrt(0.5 * (covariance(0, 0) + covariance(1, 1))), std::sqrt(covariance(2, 2))};
}

/// Angles where the misfit is less than at both neighbours.
std::vector<double> starts(const Polygon& few, const Polygon& of_reference, const Motion& centred) {
  std::vector<double> misfit;
  const auto angle = [](int k) { return 2 * std::numbers::pi * k / kAngles; };
  for (int k = 0; k < kAngles; ++k) {
    Motion motion = centred;
    motion.angle_rad = angle(k);
    misfit.push_back(mean_square(pairs_of(moved(few, motion), of_reference)));
  }
  std::vector<double> angles;
  for (int k = 0; k < kAngles; ++k)
    if (misfit[k] <= misfit[(k + 1) % kAngles] && misfit[k] < misfit[(k + kAngles - 1) % kAngles])
      angles.push_back(angle(k));
  if (angles.empty()) angles.push_back(0);
  return angles;
}

bool is_same_way(const Way& a, const Way& b, double size) {
  constexpr double kSame = 0.02;  // rad, and of the size
  return a.motion.is_mirrored == b.motion.is_mirrored &&
         std::abs(std::remainder(a.motion.angle_rad - b.motion.angle_rad, 2 * std::numbers::pi)) < kSame &&
         norm(a.motion.to_um - b.motion.to_um) < kSame * size;
}

}  // namespace

Vec2 Motion::vector(Vec2 v) const {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad), y = is_mirrored ? -v.y : v.y;
  return {c * v.x - s * y, s * v.x + c * y};
}

Vec2 Motion::vector_back(Vec2 v) const {
  const double c = std::cos(angle_rad), s = std::sin(angle_rad), y = -s * v.x + c * v.y;
  return {c * v.x + s * v.y, is_mirrored ? -y : y};
}

Polygon moved(const Polygon& polygon, const Motion& motion) {
  Polygon there;
  for (const Vec2 p : polygon) there.push_back(motion.place_um(p));
  return there;
}

Vec2 centroid_um(const Polygon& polygon) {
  Vec2 sum;
  double area = 0;
  const Vec2 origin = polygon.front();
  for (std::size_t k = 0; k < polygon.size(); ++k) {
    const Vec2 a = polygon[k] - origin, b = polygon[(k + 1) % polygon.size()] - origin;
    area += cross(a, b) / 2;
    sum += (cross(a, b) / 6) * (a + b);
  }
  return origin + (1 / area) * sum;
}

double size_um(const Polygon& polygon) { return std::sqrt(std::abs(signed_area_um2(polygon)) / std::numbers::pi); }

double misfit_um(const Polygon& a_um, const Polygon& b_um) {
  return std::sqrt(mean_square(pairs_of(resampled(a_um, kFinePoints), resampled(b_um, kFinePoints))));
}

std::vector<Way> ways_onto(const Polygon& outline_um, const Polygon& reference_um, Mirrors mirrors) {
  const Polygon outline = resampled(outline_um, kFinePoints), reference = resampled(reference_um, kFinePoints);
  const Polygon few = resampled(outline_um, kCoarsePoints), of_reference = resampled(reference_um, kCoarsePoints);
  const double size = size_um(reference_um);
  std::vector<Way> coarse;
  for (const bool is_mirrored : {false, true}) {
    if (is_mirrored && mirrors == Mirrors::not_tried) continue;
    const Motion centred{centroid_um(outline_um), centroid_um(reference_um), 0, is_mirrored};
    for (const double angle : starts(few, of_reference, centred)) {
      Motion start = centred;
      start.angle_rad = angle;
      coarse.push_back(refined(few, of_reference, start));
    }
  }
  const double best = std::ranges::min_element(coarse, {}, &Way::misfit_um)->misfit_um;
  std::vector<Way> ways;
  for (const Way& way : coarse) {
    // of few points those that fit badly are as far off as they will be
    const bool is_good = way.misfit_um < kWorthRefining * best + kCoarseMisfit * size;
    const Way fine = is_good ? refined(outline, reference, way.motion) : way;
    if (std::ranges::none_of(ways, [&](const Way& other) { return is_same_way(fine, other, size); }))
      ways.push_back(fine);
  }
  std::ranges::stable_sort(ways, {}, &Way::misfit_um);
  return ways;
}

bool fit_equally(const Way& a, const Way& b, double size_um) {
  constexpr double kSeen = 1e-3, kTenth = 1.1;
  const double floor = kSeen * size_um;
  return std::hypot(b.misfit_um, floor) < kTenth * std::hypot(a.misfit_um, floor);
}

namespace {

constexpr int kTurnsOfCircle = 72;
constexpr int kMostTurns = 24;

/// Of the axis of a mirror, where the shape has one.
std::optional<double> axis_angle_rad(const Polygon& reference) {
  for (const Way& way : ways_onto(reference, reference, Mirrors::tried))
    if (way.motion.is_mirrored) return way.motion.angle_rad / 2;
  return std::nullopt;
}

}  // namespace

Symmetry symmetry_of(const std::string& text) {
  if (text == "Cinfv") return {kTurnsOfCircle, true, true};
  Symmetry symmetry;
  const bool has_v = text.ends_with('v');
  const std::string digits = text.substr(std::min<std::size_t>(1, text.size()), text.size() - 1 - (has_v ? 1 : 0));
  symmetry.n_turns = parsed<int>(digits).value_or(0);
  if (!text.starts_with('C') || symmetry.n_turns < 1 || symmetry.n_turns > kMostTurns)
    throw UsageError(
        "--symmetry: expected C1 (none), C2, C3, ... C24, with v where it has mirrors (C4v), or Cinfv (a circle), "
        "found '" +
        text + "'");
  symmetry.has_mirrors = has_v;
  return symmetry;
}

std::vector<Motion> motions_of(const Symmetry& symmetry, const Polygon& reference) {
  const Vec2 centre = centroid_um(reference);
  const double axis = symmetry.has_mirrors && !symmetry.is_circle ? axis_angle_rad(reference).value_or(0) : 0;
  std::vector<Motion> motions;
  for (const bool is_mirrored : {false, true}) {
    if (is_mirrored && !symmetry.has_mirrors) continue;
    for (int k = 0; k < symmetry.n_turns; ++k) {
      const double turn = 2 * std::numbers::pi * k / symmetry.n_turns;
      motions.push_back({centre, centre, turn + (is_mirrored ? 2 * axis : 0), is_mirrored});
    }
  }
  return motions;
}

double asymmetry_um(const Polygon& reference, const std::vector<Motion>& motions) {
  double largest = 0;
  for (const Motion& motion : motions) largest = std::max(largest, misfit_um(moved(reference, motion), reference));
  return largest;
}

bool are_equivalent(const Way& a, const Way& b, const std::vector<Motion>& motions) {
  constexpr double kSame = 0.1;  // rad: of ways that differ by noise
  return std::ranges::any_of(motions, [&](const Motion& motion) {
    // b after the motion turns by this, and mirrors if just one of the two does
    const bool is_mirrored = b.motion.is_mirrored != motion.is_mirrored;
    const double angle = motion.angle_rad + (motion.is_mirrored ? -b.motion.angle_rad : b.motion.angle_rad);
    return is_mirrored == a.motion.is_mirrored &&
           std::abs(std::remainder(angle - a.motion.angle_rad, 2 * std::numbers::pi)) < kSame;
  });
}

}  // namespace mbtfm::mean
