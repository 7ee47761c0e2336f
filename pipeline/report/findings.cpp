#include "pipeline/report/findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/report/svg.h"
#include "pipeline/report/tension_plot.h"

namespace mbtfm::report {
namespace {

std::string percent(double share) { return readable(100 * share) + " %"; }

Finding what(const CellResults& results) {
  int n_by_type[3] = {};
  for (const Fibre& fibre : results.cell.fibres) ++n_by_type[static_cast<int>(fibre.type)];
  return {
      Level::fact,
      fmt::format("{} stress fibres ({} dorsal, {} transverse arcs, {} ventral) and {} adhesions. They pull with {} "
                  "nN in total, summed over adhesions: {} nN by the fibres, {} nN by the actin network.",
                  results.cell.fibres.size(), n_by_type[0], n_by_type[1], n_by_type[2], results.cell.adhesions.size(),
                  readable(results.fit.total_force_nN), readable(results.fit.fibre_force_nN),
                  readable(results.fit.network_force_nN))};
}

Finding truth(const Comparison& comparison) {
  std::string text = fmt::format(
      "This cell was simulated. Over the {} fibres that were found, the tensions deviate from "
      "the truth by {} (root of summed squares, relative)",
      comparison.n_matched, percent(comparison.relative_error));
  if (comparison.n_long > 0) {
    text += fmt::format("; {} of {} true fibres longer than {:g} µm were found and typed right",
                        comparison.n_long_found_and_typed, comparison.n_long, kLongFibre_um);
  }
  if (comparison.true_total_force_nN) {
    text += fmt::format("; the total force deviates by {}",
                        percent(comparison.total_force_nN / *comparison.true_total_force_nN - 1));
  }
  return {Level::fact, text + "."};
}

/// The displacement that the model explains, against what the noise would allow.
Finding quality(const FitSummary& fit) {
  if (!(fit.expected_relative_l2 > 0)) {
    return {Level::caution,
            fmt::format("The model leaves {} of the displacement unexplained (relative L2). The noise of the beads is "
                        "not known, so it cannot be told what share of it is noise.",
                        percent(fit.relative_l2))};
  }
  const double excess2 = std::pow(fit.relative_l2, 2) - std::pow(fit.expected_relative_l2, 2);
  const std::string text = fmt::format(
      "The model leaves {} of the displacement unexplained (relative L2); bead noise of {} nm alone would leave {}.",
      percent(fit.relative_l2), readable(1000 * fit.noise_um), percent(fit.expected_relative_l2));
  if (excess2 <= 0) return {Level::good, text + " The fit is as good as the noise allows."};
  const double excess = std::sqrt(excess2);
  // Up to half of the noise, the model's error adds less than an eighth to what is left.
  const Level level = excess < 0.5 * fit.expected_relative_l2 ? Level::good : Level::caution;
  return {level,
          text + fmt::format(" The rest, {}, is the error of the model: mesh, segmentation, gel.", percent(excess))};
}

std::vector<Finding> doubts(const CellResults& results) {
  std::vector<Finding> list;
  int n_unidentifiable = 0, n_wide = 0, n_zero = 0, n_missing = 0;
  for (const Fibre& fibre : results.cell.fibres) n_missing += results.tensions.contains(fibre.fibre_id) ? 0 : 1;
  for (const FibreRow& row : fibre_rows(results)) {
    const Tension& t = row.tension;
    if (!t.identifiable) ++n_unidentifiable;
    if (t.identifiable && t.low_nN && t.high_nN && *t.high_nN - *t.low_nN > 2 * t.tension_nN) ++n_wide;
    if (t.tension_nN == 0) ++n_zero;
  }
  if (n_unidentifiable > 0) {
    list.push_back({Level::bad, fmt::format("{} tensions are not identifiable from this displacement: disregard them "
                                            "(hollow marks).",
                                            n_unidentifiable)});
  }
  if (n_wide > 0) {
    list.push_back(
        {Level::caution, fmt::format("{} tensions are uncertain by their own size or more (95 % interval).", n_wide)});
  }
  if (n_zero > 0) {
    list.push_back(
        {Level::caution, fmt::format("{} tensions are at the bound of zero: the fit would push them below.", n_zero)});
  }
  if (n_missing > 0) {
    list.push_back(
        {Level::caution, fmt::format("{} segmented fibres are not in the network and have no tension.", n_missing)});
  }
  if (results.fit.n_meshes == 1) {
    list.push_back({Level::caution,
                    "Fitted on one mesh: the intervals hold the noise of the beads but not the choice "
                    "of the mesh, which is usually the larger error."});
  }
  const Balance balance = balance_of(results);
  // The forces of a cell sum to nothing. The torques do so where moments of single adhesions are counted; ours are
  // not in the table, so a few per mille are natural.
  constexpr double kRounding = 1e-6;
  if (balance.net_force > kRounding) {
    list.push_back({Level::bad, fmt::format("The forces do not sum to nothing: |sum| / sum of magnitudes = {:.1e}.",
                                            balance.net_force)});
  }
  return list;
}

}  // namespace

Balance balance_of(const CellResults& results) {
  const auto by_id = adhesions_by_id(results.cell);
  Vec2 centre;
  for (const Adhesion& adhesion : results.cell.adhesions) {
    centre += (1.0 / static_cast<double>(results.cell.adhesions.size())) * adhesion.position_um;
  }
  Vec2 net;
  double torque = 0, magnitudes = 0, lever = 0;
  for (const AdhesionForce& force : results.forces) {
    const Vec2 arm = by_id.at(force.adhesion_id)->position_um - centre;
    net += force.force_nN;
    torque += cross(arm, force.force_nN);
    magnitudes += norm(force.force_nN);
    lever += norm(arm) * norm(force.force_nN);
  }
  if (!(magnitudes > 0)) return {};
  return {.net_force = norm(net) / magnitudes, .net_torque = lever > 0 ? std::abs(torque) / lever : 0};
}

std::vector<Finding> findings_of(const CellResults& results, const std::vector<std::string>& not_converged,
                                 const std::vector<std::string>& by_hand) {
  std::vector<Finding> list = {what(results)};
  if (results.comparison) list.push_back(truth(*results.comparison));
  for (const std::string& stage : not_converged) {
    list.push_back({Level::bad, "The stage " + stage + " did not converge: what follows from it is provisional."});
  }
  list.push_back(quality(results.fit));
  for (Finding& doubt : doubts(results)) list.push_back(std::move(doubt));
  for (const std::string& sentence : by_hand) list.push_back({Level::fact, sentence});
  return list;
}

}  // namespace mbtfm::report
