#include "mbtfm/tensions/findings.h"

#include <algorithm>
#include <cmath>

#include "mbtfm/tensions/residual_findings.h"
#include "pipeline/contract/counted.h"
#include "pipeline/contract/extent.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/listed.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/with_error.h"

namespace mbtfm::tensions {

namespace {

using Noticed = std::optional<Finding>;

/// "3, 7 and 12"; of many the first ones.
std::string listed(const std::vector<int>& ids) {
  constexpr std::size_t kMost = 8;
  std::string text;
  for (std::size_t i = 0; i < std::min(kMost, ids.size()); ++i) {
    if (i > 0) text += i + 1 == ids.size() ? " and " : ", ";
    text += std::to_string(ids[i]);
  }
  return ids.size() > kMost ? text + ", ..." : text;
}

Noticed explains_little(const FitOutcome& o) {
  const double noise = o.summary.expected_relative_l2 * o.summary.expected_relative_l2;  // of the beads' own squares
  if (noise <= 0 || noise >= 1) return {};
  const double share = unexplained_share(o.summary);
  // of the noise's squares, which far beads tell, and of what is left
  const double sigma = 2 * noise / (1 - noise) / std::sqrt(static_cast<double>(std::max<Index>(1, o.data.n_used)));
  return noticed(FindingKind::explains_little, share - 3 * sigma,
                 "The model explains " + brief(100 * (1 - share)) +
                     " % of what the beads do beyond their noise. It is the wrong model of these beads.");
}

Noticed strain_beyond_linear(const FitOutcome& o) {
  if (o.strain.is_on) return {};
  const double share = o.strain.number.value_or(0);
  return noticed(FindingKind::strain_beyond_linear, share,
                 "The forces strain the gel so far that small-strain elasticity is off by some " + brief(100 * share) +
                     " % of the displacement.");
}

Noticed noise_unknown(const FitOutcome& o) {
  const bool is_known = o.data.has_errors || o.has_far_beads;
  return noticed(FindingKind::noise_unknown, is_known ? 0 : static_cast<double>(o.data.position_um.size()),
                 "The noise of the beads is not known: the displacement states no errors, and too few beads lie far "
                 "from the cell. What the model leaves unexplained is taken for noise.");
}

Noticed no_beads_at_adhesions(const FitOutcome& o) {
  const std::vector<int> ids = adhesions_without_beads(o.cell.adhesions, o.data.position_um);
  return noticed(FindingKind::adhesions_without_beads, static_cast<double>(ids.size()),
                 counted(static_cast<std::int64_t>(ids.size()), "adhesion has", "adhesions have") +
                     " no bead near by: " + listed(ids) + ".");
}

/// "from adhesion 3 to 12 with 5.1 +- 0.4 nN (fibre 7 ends beside them); ..."
std::string listed(const std::vector<MissingFibre>& fibres) {
  std::string text;
  constexpr std::size_t kMost = 4;
  for (std::size_t i = 0; i < std::min(kMost, fibres.size()); ++i) {
    const MissingFibre& f = fibres[i];
    text += (i > 0 ? "; " : "") + std::string("from adhesion ") + std::to_string(f.start_adhesion_id) + " to " +
            std::to_string(f.end_adhesion_id) + " with " + with_error(f.tension_nN, sigma_nN(f)) + " nN";
    if (f.beside_fibre_id) text += " (fibre " + std::to_string(*f.beside_fibre_id) + " ends beside them)";
  }
  return fibres.size() > kMost ? text + "; ... (missing_fibres.csv)" : text;
}

Noticed missing_fibres_noticed(const FitOutcome& o) {
  const auto n = std::ssize(o.missing);
  const bool are_all_beside =
      std::ranges::all_of(o.missing, [](const MissingFibre& f) { return f.beside_fibre_id.has_value(); });
  return noticed(
      FindingKind::missing_fibre, static_cast<double>(n),
      (are_all_beside ? "The beads put the ends of " + counted(n, "fibre", "fibres") + " elsewhere: "
                      : "The beads call for " + counted(n, "fibre that was", "fibres that were") + " not segmented: ") +
          listed(o.missing) + ".");
}

Noticed missing_adhesions_noticed(const FitOutcome& o) {
  const std::vector<MissingAdhesion>& missing = o.missing_adhesions;
  std::string text = "The beads call for " + counted(static_cast<std::int64_t>(missing.size()), "force", "forces") +
                     " where no adhesion was found: ";
  constexpr std::size_t kMost = 4;
  for (std::size_t i = 0; i < std::min(kMost, missing.size()); ++i) {
    const MissingAdhesion& a = missing[i];
    text += (i > 0 ? "; " : "") + brief(norm(a.force_nN)) + " nN at (" + brief(a.position_um.x) + ", " +
            brief(a.position_um.y) + ") um";
  }
  if (missing.size() > kMost) text += "; ... (missing_adhesions.csv)";
  return noticed(FindingKind::missing_adhesion, static_cast<double>(missing.size()), text + ".");
}

Noticed fibres_without_tension(const FitOutcome& o) {
  std::vector<int> ids;
  for (const Fibre& fibre : o.cell.fibres) {
    const auto has = [&](const Tension& t) { return t.fibre_id == fibre.fibre_id; };
    if (std::ranges::none_of(o.tensions, has)) ids.push_back(fibre.fibre_id);
  }
  return noticed(FindingKind::fibre_without_tension, static_cast<double>(ids.size()),
                 counted(static_cast<std::int64_t>(ids.size()), "segmented fibre has", "segmented fibres have") +
                     " no tension: " + listed(ids) + ".");
}

/// Fibres whose tension is so.
template <class Predicate>
std::vector<int> fibres_whose(const std::vector<Tension>& tensions, const Predicate& is_so) {
  std::vector<int> ids;
  for (const Tension& t : tensions) {
    if (t.fibre_id > 0 && is_so(t)) ids.push_back(t.fibre_id);
  }
  return ids;
}

Noticed noticed_of_fibres(FindingKind kind, const std::vector<int>& ids, const std::string& one,
                          const std::string& many) {
  return noticed(kind, static_cast<double>(ids.size()),
                 counted(static_cast<std::int64_t>(ids.size()), one, many) +
                     (ids.size() == 1 ? " (fibre " : " (fibres ") + listed(ids) + ").");
}

Noticed not_identifiable(const FitOutcome& o) {
  return noticed_of_fibres(FindingKind::not_identifiable,
                           fibres_whose(o.tensions, [](const Tension& t) { return !t.identifiable; }),
                           "tension is not determined by these beads", "tensions are not determined by these beads");
}

Noticed network_not_identifiable(const FitOutcome& o) {
  const bool is_unknown =
      std::ranges::any_of(o.tensions, [](const Tension& t) { return t.fibre_id == 0 && !t.identifiable; });
  return noticed(FindingKind::network_not_identifiable, is_unknown ? 1 : 0,
                 "The tension of the actin network is not determined by these beads.");
}

Noticed wide_intervals(const FitOutcome& o) {
  const auto is_wide = [](const Tension& t) { return t.identifiable && t.tension_nN > 0 && is_uncertain(t); };
  return noticed_of_fibres(FindingKind::wide_interval, fibres_whose(o.tensions, is_wide),
                           "tension is uncertain by as much as itself",
                           "tensions are uncertain by as much as themselves");
}

Noticed tensions_at_zero(const FitOutcome& o) {
  return noticed_of_fibres(FindingKind::tension_at_zero,
                           fibres_whose(o.tensions, [](const Tension& t) { return t.tension_nN == 0; }),
                           "tension is zero, the least allowed", "tensions are zero, the least allowed");
}

Noticed single_mesh(const FitOutcome& o) {
  return noticed(FindingKind::single_mesh, o.summary.n_meshes == 1 ? 1 : 0,
                 "One mesh was fitted. The intervals hold the noise of the beads, and not the choice of the mesh.");
}

Noticed out_of_balance(FindingKind kind, double imbalance, const std::string& what) {
  return noticed(kind, imbalance,
                 "The " + what + " do not sum to zero: |sum| / sum of magnitudes = " + brief(imbalance) + ".");
}

Noticed cell_cut(const FitOutcome& o) {
  if (!o.fit.cut) return {};
  const Estimate& force = o.fit.cut->magnitude_nN;
  return noticed(
      FindingKind::cell_cut, 1,
      "The image's border cuts the cell. The fit holds the network along the cut; " +
          with_error(force.value, force.standard_error) + " nN pass through it. " +
          (o.beyond ? "Forces beyond the cut were allowed for; fibres and adhesions near it have larger errors."
                    : "Forces beyond the cut were not allowed for (effects.beyond_cut = off): they are taken for "
                      "forces of the adhesions near it."),
      o.beyond ? Severity::note : Severity::caution);
}

/// "Another cell pulls 12 um from this one, at (80, 31) um"; empty: none is in the image.
std::string nearest_neighbour(const Cell& cell) {
  double nearest_um = 1e300;
  Vec2 place_um;
  for (const Polygon& other : cell.neighbours_um) {
    for (const Vec2 p : other) {
      const double distance_um = distance_to_boundary_um(cell.outline_um, p);
      if (distance_um < nearest_um) nearest_um = distance_um, place_um = p;
    }
  }
  if (cell.neighbours_um.empty()) return "";
  return "Another cell pulls " + brief(nearest_um) + " um from this one, at (" + brief(place_um.x) + ", " +
         brief(place_um.y) + ") um. ";
}

Noticed neighbour_pulls(const FitOutcome& o) {
  const std::size_t n_beyond = o.beyond ? o.beyond->borders.size() : 0;
  std::string text = nearest_neighbour(o.cell);
  if (n_beyond > 0) text += "Something pulls beyond the border, at the " + mbtfm::listed(o.beyond->borders) + ". ";
  if (text.empty()) return {};
  text += o.beyond ? "Its forces were allowed for." : "Its forces were not allowed for (effects.beyond_cut = off).";
  return noticed(FindingKind::neighbour_pulls, static_cast<double>(o.cell.neighbours_um.size() + n_beyond), text,
                 o.beyond ? Severity::note : Severity::caution);
}

Noticed common_motion(const FitOutcome& o) {
  if (!o.motion) return {};
  const AffineMotion& m = o.motion->motion;
  double largest = 0;  // in standard errors
  const double values[] = {m.turn_rad, m.growth, m.stretch, m.skew};
  for (int i = 0; i < 4; ++i) largest = std::max(largest, std::abs(values[i]) / o.motion->sigma[i + 2]);
  constexpr double kLarge = 0.01;  // of all lengths: no refocus and no warming does that
  const bool is_large = std::max({std::abs(m.growth), std::abs(m.stretch), std::abs(m.skew)}) > kLarge;
  return noticed(FindingKind::common_motion, largest,
                 "All beads share a motion beside the cell's pull: " + sentence_of(*o.motion) + ". It was taken off." +
                     (is_large ? " It is too large for a change of focus or of temperature: were both pictures taken "
                                 "with the same objective?"
                               : ""),
                 is_large ? Severity::caution : Severity::note);
}

Noticed curved_motion(const FitOutcome& o) {
  if (!o.curved) return {};
  return noticed(FindingKind::curved_motion, o.curved->chi_squared,
                 "Beside the cell's pull all beads share a motion that is not even: it moves them by " +
                     brief(1000 * o.curved->rms_um) +
                     " nm on average. It was not taken off, and the error bars do not hold it.");
}

Noticed channel_shift(const FitOutcome& o) {
  if (!o.place) return {};
  const Placement& place = o.place->placement;
  const Eigen::Vector3d values(place.shift_um.x, place.shift_um.y, place.turn_rad);
  constexpr double kLarge_um = 1;  // filters are off by less
  const bool is_large = norm(place.shift_um) > kLarge_um;
  return noticed(FindingKind::channel_shift, values.cwiseAbs().cwiseQuotient(o.place->sigma).maxCoeff(),
                 "The cell does not lie on the beads where its images say: it is shifted by " + sentence_of(*o.place) +
                     "." + (is_large ? " Filters are off by less: do all images show the same place?" : ""),
                 is_large ? Severity::caution : Severity::note);
}

}  // namespace

double unexplained_share(const FitSummary& summary) {
  const double left = summary.relative_l2 * summary.relative_l2;
  const double noise = summary.expected_relative_l2 * summary.expected_relative_l2;
  return noise < 1 ? (left - noise) / (1 - noise) : 0;
}

std::vector<int> adhesions_without_beads(const std::vector<Adhesion>& adhesions, const std::vector<Vec2>& beads_um) {
  constexpr double kFar = 3;  // distances of beads: at random the chance is exp(−9 pi)
  const double far_um =
      kFar * std::sqrt(extent_of(beads_um).area_um2() / std::max(1.0, static_cast<double>(beads_um.size())));
  std::vector<int> ids;
  for (const Adhesion& a : adhesions) {
    const auto is_near = [&](Vec2 bead) { return norm(bead - a.position_um) <= far_um; };
    if (std::ranges::none_of(beads_um, is_near)) ids.push_back(a.adhesion_id);
  }
  return ids;
}

Imbalance imbalance_of(const EnsembleFit& fit) {
  Eigen::Vector2d net_nN = Eigen::Vector2d::Zero();
  for (Index i = 0; i < fit.forces.nN.size(); i += 2) net_nN += fit.forces.nN.segment<2>(i);
  const CutReaction cut = fit.cut ? fit.cut->reaction : CutReaction{};
  constexpr double kTiny = 1e-300;  // a cell without any force is balanced
  return {.force = (net_nN + cut.force_nN).norm() / std::max(total_nN(fit.forces.nN), kTiny),
          .torque = std::abs(fit.forces.torques_nN_um.sum() + cut.torque_nN_um) /
                    std::max(fit.forces.torques_nN_um.cwiseAbs().sum(), kTiny)};
}

std::vector<Finding> findings_of(const FitOutcome& o) {
  const Imbalance imbalance = imbalance_of(o.fit);
  std::vector<Finding> findings;
  for (Noticed found : {cell_cut(o),
                        neighbour_pulls(o),
                        common_motion(o),
                        curved_motion(o),
                        channel_shift(o),
                        missing_fibres_noticed(o),
                        missing_adhesions_noticed(o),
                        no_beads_at_adhesions(o),
                        explains_little(o),
                        unexplained(o),
                        strain_beyond_linear(o),
                        beads_disagree(o),
                        telling_beads_scatter(o),
                        noise_unknown(o),
                        noise_disagrees(o),
                        not_identifiable(o),
                        network_not_identifiable(o),
                        fibres_without_tension(o),
                        single_mesh(o),
                        out_of_balance(FindingKind::forces_out_of_balance, imbalance.force, "forces"),
                        out_of_balance(FindingKind::torques_out_of_balance, imbalance.torque, "torques"),
                        wide_intervals(o),
                        tensions_at_zero(o)}) {
    if (found) findings.push_back(std::move(*found));
  }
  return findings;
}

}  // namespace mbtfm::tensions
