#include "mbtfm/findings.h"

#include <algorithm>
#include <cmath>

#include "pipeline/contract/csv.h"

namespace mbtfm::inverse {

namespace {

using Noticed = std::optional<Finding>;

std::string counted(std::int64_t n, const std::string& one, const std::string& many) {
  return std::to_string(n) + " " + (n == 1 ? one : many);
}

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

double squared_ratio(const FitSummary& summary) {
  return summary.expected_relative_l2 > 0 ? std::pow(summary.relative_l2 / summary.expected_relative_l2, 2) : 0;
}

Noticed unexplained(const FitOutcome& o) {
  const double ratio = squared_ratio(o.summary);
  return noticed(FindingKind::unexplained_displacement, ratio,
                 "The model leaves " + brief(ratio) + " times the sum of squares that the noise of the beads (" +
                     brief(1000 * o.summary.noise_um) +
                     " nm a component) would leave. The rest is an error of the model: mesh, segmentation or gel.");
}

Noticed noise_unknown(const FitOutcome& o) {
  const bool is_known = o.summary.expected_relative_l2 > 0;
  return noticed(FindingKind::noise_unknown, is_known ? 0 : static_cast<double>(o.data.displacement_um.size() / 2),
                 "The noise of the beads is not known.");
}

Noticed missing_fibres_noticed(const FitOutcome& o) {
  std::string text = "The beads call for " +
                     counted(static_cast<std::int64_t>(o.missing.size()), "fibre that was", "fibres that were") +
                     " not segmented: ";
  constexpr std::size_t kMost = 4;
  for (std::size_t i = 0; i < std::min(kMost, o.missing.size()); ++i) {
    const MissingFibre& f = o.missing[i];
    text += (i > 0 ? "; " : "") + std::string("from adhesion ") + std::to_string(f.start_adhesion_id) + " to " +
            std::to_string(f.end_adhesion_id) + " with " + brief(f.tension_nN) + " +- " +
            brief(f.tension_nN / std::sqrt(f.chi_squared_gain)) + " nN";
  }
  if (o.missing.size() > kMost) text += "; ... (missing_fibres.csv)";
  return noticed(FindingKind::missing_fibre, static_cast<double>(o.missing.size()), text + ".");
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
                 counted(static_cast<std::int64_t>(ids.size()), one, many) + " (fibre " + listed(ids) + ").");
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
  const auto is_wide = [](const Tension& t) {
    return t.identifiable && t.tension_nN > 0 && t.low_nN && t.high_nN && *t.high_nN - *t.low_nN > 2 * t.tension_nN;
  };
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
  return noticed(kind, imbalance, "The " + what + " do not sum to zero: |sum| / sum of magnitudes = " +
                                      brief(imbalance) + ".");
}

Noticed common_motion(const FitOutcome& o) {
  if (!o.motion) return {};
  const CommonMotion& m = o.motion->motion;
  double largest = 0;  // in standard errors
  const double values[] = {m.turn_rad, m.growth, m.shear_1, m.shear_2};
  for (int i = 0; i < 4; ++i) largest = std::max(largest, std::abs(values[i]) / o.motion->sigma[i + 2]);
  constexpr double kLarge = 0.01;  // of all lengths: no refocus and no warming does that
  const bool is_large = std::max({std::abs(m.growth), std::abs(m.shear_1), std::abs(m.shear_2)}) > kLarge;
  return noticed(FindingKind::common_motion, largest,
                 "All beads share a motion beside the cell's pull: " + sentence_of(*o.motion) + ". It was taken off." +
                     (is_large ? " It is too large for a change of focus or of temperature: were both pictures taken "
                                 "with the same objective?"
                               : ""),
                 is_large ? Severity::caution : Severity::note);
}

}  // namespace

Imbalance imbalance_of(const EnsembleFit& fit) {
  Eigen::Vector2d net_nN = Eigen::Vector2d::Zero();
  for (Eigen::Index i = 0; i < fit.forces_nN.size(); i += 2) net_nN += fit.forces_nN.segment<2>(i);
  constexpr double kTiny = 1e-300;  // a cell without any force is balanced
  return {.force = net_nN.norm() / std::max(total_nN(fit.forces_nN), kTiny),
          .torque = std::abs(fit.torques_nN_um.sum()) / std::max(fit.torques_nN_um.cwiseAbs().sum(), kTiny)};
}

std::vector<Finding> findings_of(const FitOutcome& o) {
  const Imbalance imbalance = imbalance_of(o.fit);
  std::vector<Finding> findings;
  for (Noticed found :
       {common_motion(o), missing_fibres_noticed(o), unexplained(o), noise_unknown(o), not_identifiable(o),
        network_not_identifiable(o), fibres_without_tension(o), single_mesh(o),
        out_of_balance(FindingKind::forces_out_of_balance, imbalance.force, "forces"),
        out_of_balance(FindingKind::torques_out_of_balance, imbalance.torque, "torques"), wide_intervals(o),
        tensions_at_zero(o)}) {
    if (found) findings.push_back(std::move(*found));
  }
  return findings;
}

}  // namespace mbtfm::inverse
