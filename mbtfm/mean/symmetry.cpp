#include "mbtfm/mean/symmetry.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <numbers>
#include <optional>

#include "pipeline/contract/errors.h"

namespace mbtfm::mean {
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
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), symmetry.n_turns);
  if (!text.starts_with('C') || error != std::errc() || end != digits.data() + digits.size() || symmetry.n_turns < 1 ||
      symmetry.n_turns > kMostTurns)
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
