#include "segment/stacks/findings.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/numerics/order_statistics.h"

namespace mbtfm::stacks {

FieldFigures figures_of(const std::vector<BeadInSpace>& field) {
  FieldFigures f;
  std::vector<double> sigma, sigma_z;
  for (const BeadInSpace& bead : field) {
    if (!bead.flag.empty()) continue;
    const Vec3 u = bead.displacement_um;
    constexpr double kMoving = 3, kSurely = 6;  // standard errors
    const double off =
        std::hypot(std::hypot(u.x, u.y) / std::max(1e-9, bead.sigma_um), u.z / std::max(1e-9, bead.sigma_z_um));
    if (off > kMoving) ++f.n_moving;
    if (off > kSurely) ++f.n_surely_moving;
    f.largest_um = std::max(f.largest_um, norm(u));
    sigma.push_back(bead.sigma_um), sigma_z.push_back(bead.sigma_z_um);
  }
  if (!sigma.empty()) f.sigma_um = numerics::median(sigma), f.sigma_z_um = numerics::median(sigma_z);
  return f;
}

double rms_drift_um(const CommonMotion& c) {
  double sum = 0;
  for (const Vec2& s : c.slices_um) sum += dot(s, s);
  return c.slices_um.empty() ? 0 : std::sqrt(sum / (2.0 * static_cast<double>(c.slices_um.size())));
}

std::int64_t count(const Followed& f, TrackFlag flag) {
  const auto found = f.flags.find(name_of(flag));
  return found == f.flags.end() ? 0 : found->second;
}

double share_followed(const Followed& f) {
  const std::int64_t inside = static_cast<std::int64_t>(f.field.size()) - count(f, TrackFlag::edge);
  return static_cast<double>(f.n_good) / static_cast<double>(std::max<std::int64_t>(1, inside));
}

double WidthRatio::larger() const { return std::max({across, 1 / across, along, 1 / along}); }

WidthRatio width_ratio(const Detection& relaxed, const Detection& stressed) {
  const Widths a = relaxed.widths_in_the_middle(), b = stressed.widths_in_the_middle();
  return {b.xy / a.xy, b.z / a.z};
}

std::vector<Finding> findings_of(const Followed& f, const WidthRatio& widths, double saturated) {
  std::vector<Finding> findings;
  const auto add = [&](std::optional<Finding> found) {
    if (found) findings.push_back(std::move(*found));
  };
  const std::int64_t n_moving = figures_of(f.field).n_surely_moving;
  const double moving = static_cast<double>(n_moving) / std::max(1, f.n_good);
  add(noticed(FindingKind::saturated, saturated,
              "A stack is saturated: " + brief(100 * saturated) + " % of its voxels are at the detector's limit."));
  add(noticed(FindingKind::nothing_moves, 1 - moving,
              "Nothing moves: " + std::to_string(n_moving) + " of " + std::to_string(f.n_good) +
                  " beads by more than six standard errors."));
  add(noticed(FindingKind::beads_lost, 1 - share_followed(f),
              brief(100 * (1 - share_followed(f))) +
                  " % of the beads were not followed: " + std::to_string(count(f, TrackFlag::no_partner)) +
                  " have no partner, " + std::to_string(count(f, TrackFlag::ambiguous)) + " more than one, " +
                  std::to_string(count(f, TrackFlag::neighbours_disagree)) + " contradict their neighbours."));
  add(noticed(FindingKind::little_at_rest, 1 - f.common.share_at_rest,
              "Only " + brief(100 * f.common.share_at_rest) +
                  " % of the beads move alike, as those at rest do. The motion of the stage is found from these."));
  add(noticed(FindingKind::slices_moved, f.common.slice_drift_ratio,
              "The slices of one stack moved against those of the other by " + brief(rms_drift_um(f.common)) +
                  " um (root mean square); it was " + (f.common.has_slice_drift ? "" : "not ") + "taken off."));
  add(noticed(FindingKind::beads_scatter, std::max(f.error_ratio, f.error_ratio_z),
              "Beads that lie together differ by " + brief(f.error_ratio) + " times their errors across and " +
                  brief(f.error_ratio_z) + " times along z; the standard errors were raised by that."));
  add(noticed(FindingKind::defocused, widths.larger(),
              "The beads of the stressed stack are " + brief(widths.across) + " times as wide and " +
                  brief(widths.along) + " times as long as those of the relaxed one."));
  if (f.light_ratio > 0) {
    add(noticed(
        FindingKind::light_lost, 1 - std::min(f.light_ratio, 1 / f.light_ratio),
        "The beads of the stressed stack have " + brief(f.light_ratio) + " times the light of the relaxed one's."));
  }
  return findings;
}

}  // namespace mbtfm::stacks
