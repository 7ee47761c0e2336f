#include "segment/cells/fibre_significance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace mbtfm::cells {
namespace {

double filter_sigma_um(const FibreParameters& p) {
  constexpr double kFwhm = 2.3548;  // full width at half maximum of a Gaussian in standard deviations
  constexpr double kNarrower = 0.6;
  return kNarrower * p.fibre_width_um / kFwhm;
}

}  // namespace

int grid_factor(const FibreParameters& p, double pixel_um) {
  constexpr double kSigma_px = 1.2;
  return std::max(1, static_cast<int>(filter_sigma_um(p) / pixel_um / kSigma_px));
}

RidgeScales scales_of(const FibreParameters& p, double pixel_um) {
  constexpr double kNarrowest_px = 0.7;  // pixels carry no more
  return {.width_sigma_px = std::max(kNarrowest_px, filter_sigma_um(p) / pixel_um),
          .length_sigma_px = p.fibre_averaging_um / pixel_um,
          .noise_radius_px = std::max(6.0, 8 * p.fibre_width_um / pixel_um)};
}

TraceRule rule_of(const FibreParameters& p, double pixel_um) {
  constexpr double kHidden = 3;      // widths: so long a line that crosses at 20° hides this one
  constexpr double kStraight = 0.2;  // noise and waves of a fibre, of its radius
  constexpr double kGentle = 8;      // long fibres bend less than the smallest radius by so much
  TraceRule rule;
  rule.start_noise = p.fibre_start_noise;
  rule.follow_noise = p.fibre_follow_noise;
  const double gap_and_beyond_um = 2 * p.fibre_gap_um;
  rule.start_gain_px = gap_and_beyond_um / pixel_um;
  rule.reach_px = std::max(gap_and_beyond_um, kHidden * p.fibre_width_um) / pixel_um;
  rule.step_px = 0.5 * p.fibre_width_um / pixel_um;
  rule.through_px = 3 * p.fibre_gap_um / pixel_um;
  rule.smallest_radius_px = p.fibre_smallest_radius_um / pixel_um;
  rule.line_radius_px = 0.6 * p.fibre_width_um / pixel_um;
  rule.shortest_px = p.fibre_shortest_um / pixel_um;
  rule.end_window_px = 4 * p.fibre_averaging_um / pixel_um;
  rule.course_px = 3.4 * p.fibre_averaging_um / pixel_um;
  rule.join_gap_px = 3 * p.fibre_gap_um / pixel_um;
  rule.overlap_px = 1.92 * p.fibre_gap_um / pixel_um;
  rule.bridge_px = 6 * p.fibre_gap_um / pixel_um;
  rule.bridge_course_px = 2 * p.fibre_shortest_um / pixel_um;
  rule.bridge_misfit_px = kStraight * rule.line_radius_px;
  rule.bridge_radius_px = kGentle * rule.smallest_radius_px;
  rule.faint_px = p.fibre_faint_um / pixel_um;
  return rule;
}

double independent_px(const FibreParameters& p, double pixel_um) {
  // noise through a Gaussian of deviation s correlates over 2 sqrt(pi) s
  return 2 * std::sqrt(std::numbers::pi) * p.fibre_averaging_um / pixel_um;
}

}  // namespace mbtfm::cells
