#include "pipeline/report/findings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "pipeline/report/numbers.h"
#include "pipeline/report/tension_plot.h"
#include "pipeline/report/tension_table.h"

namespace mbtfm::report {
namespace {

/// Two digits, or all before the point: more would not last from one experiment to the next.
std::string two_digits(double value) {
  const std::string text = std::abs(value) >= 9.95 ? fmt::format("{:.0f}", value) : fmt::format("{:.2g}", value);
  return text[0] == '-' ? "−" + text.substr(1) : text;
}

std::string percent(double share) { return two_digits(100 * share) + " %"; }

std::string counted(std::size_t n, const std::string& one, const std::string& many) {
  return fmt::format("{} {}", n, n == 1 ? one : many);
}

Finding what(const CellResults& results) {
  int n_by_type[3] = {};
  for (const Fibre& fibre : results.cell.fibres) ++n_by_type[static_cast<int>(fibre.type)];
  return {
      Level::fact,
      fmt::format("{} ({} dorsal, {}, {} ventral) and {}. The cell pulls with {} nN in total, summed over its "
                  "adhesions: {} nN by the fibres, {} nN by the actin network.",
                  counted(results.cell.fibres.size(), "stress fibre", "stress fibres"), n_by_type[0],
                  counted(n_by_type[1], "transverse arc", "transverse arcs"), n_by_type[2],
                  counted(results.cell.adhesions.size(), "adhesion", "adhesions"), readable(results.fit.total_force_nN),
                  readable(results.fit.fibre_force_nN), readable(results.fit.network_force_nN))};
}

Finding truth(const CellResults& results) {
  const Comparison& comparison = *results.comparison;
  std::string text = fmt::format(
      "This cell was simulated, so the truth is known. Over the {} found, the tensions deviate from it by {} (root of "
      "the summed squares, relative)",
      counted(comparison.n_matched, "fibre", "fibres"), percent(comparison.relative_error));
  if (const Coverage coverage = coverage_of(results); coverage.n > 0) {
    text += fmt::format("; the 95 % interval holds the truth for {} of {}", coverage.n_inside, coverage.n);
  }
  if (comparison.n_long > 0) {
    text += fmt::format("; {} of {} longer than {:g} µm {} found and typed right", comparison.n_long_found_and_typed,
                        counted(comparison.n_long, "true fibre", "true fibres"), kLongFibre_um,
                        comparison.n_long_found_and_typed == 1 ? "was" : "were");
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
  const double left2 = std::pow(fit.relative_l2, 2), noise2 = std::pow(fit.expected_relative_l2, 2);
  std::string text;
  if (left2 <= noise2) {
    text = fmt::format(
        "All that the model leaves unexplained of the displacement is the noise of the beads ({} nm a component): "
        "relative L2 {}, by noise alone {}.",
        two_digits(1000 * fit.noise_um), percent(fit.relative_l2), percent(fit.expected_relative_l2));
  } else {
    text = fmt::format(
        "Of the displacement that the model leaves unexplained, {:.0f} % is the noise of the beads ({} "
        "nm a component) and {:.0f} % the error of the model (mesh, segmentation, gel), as shares of the "
        "sum of squares. Relative L2 {}, by noise alone {}.",
        100 * noise2 / left2, two_digits(1000 * fit.noise_um), 100 * (1 - noise2 / left2), percent(fit.relative_l2),
        percent(fit.expected_relative_l2));
  }
  constexpr double kLarge = 0.3;  // a reader may take it for a bad fit
  if (fit.expected_relative_l2 > kLarge) {
    text +=
        " These are large because relative L2 counts every bead, also the many far from the cell that move less "
        "than their noise.";
  }
  // Up to half of the noise, the model's error adds less than an eighth to what is left.
  return {left2 < 1.25 * noise2 ? Level::good : Level::caution, text};
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
    list.push_back({Level::bad, counted(n_unidentifiable, "tension is", "tensions are") +
                                    " not identifiable from this displacement: disregard (hollow marks)."});
  }
  if (n_wide > 0) {
    list.push_back({Level::caution, counted(n_wide, "tension is", "tensions are") +
                                        " uncertain by as much as the tension itself or more (95 % interval)."});
  }
  if (n_zero > 0) {
    list.push_back({Level::caution,
                    counted(n_zero, "tension is", "tensions are") +
                        " zero, the least allowed: fibres do not push. Read the interval’s upper end as a limit."});
  }
  if (n_missing > 0) {
    list.push_back({Level::caution, counted(n_missing, "segmented fibre has", "segmented fibres have") +
                                        " no tension: not in the network."});
  }
  if (results.fit.n_meshes == 1) {
    list.push_back({Level::caution,
                    "Fitted on one mesh: the intervals hold the noise of the beads but not the choice "
                    "of the mesh, which is usually the larger error."});
  }
  const Balance balance = balance_of(results);
  constexpr double kRounding = 1e-6;  // equilibria are solved to 1e-9 of the largest tension, at some thousand vertices
  if (balance.net_force > kRounding) {
    list.push_back({Level::bad, fmt::format("The forces do not sum to nothing: |sum| / sum of magnitudes = {:.1e}.",
                                            balance.net_force)});
  }
  if (balance.net_torque > kRounding && balance.has_moments) {
    list.push_back({Level::bad, fmt::format("The torques do not sum to nothing: |sum| / sum of magnitudes = {:.1e}.",
                                            balance.net_torque)});
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
  bool has_moments = true;
  for (const AdhesionForce& force : results.forces) {
    const Vec2 arm = by_id.at(force.adhesion_id)->position_um - centre;
    net += force.force_nN;
    torque += cross(arm, force.force_nN) + force.moment_nN_um.value_or(0);
    has_moments = has_moments && force.moment_nN_um.has_value();
    magnitudes += norm(force.force_nN);
    lever += norm(arm) * norm(force.force_nN);
  }
  if (!(magnitudes > 0)) return {};
  return {.net_force = norm(net) / magnitudes,
          .net_torque = lever > 0 ? std::abs(torque) / lever : 0,
          .has_moments = has_moments};
}

std::vector<Finding> findings_of(const CellResults& results, const std::vector<std::string>& not_converged,
                                 const std::vector<std::string>& by_hand) {
  std::vector<Finding> list = {what(results)};
  if (results.comparison) list.push_back(truth(results));
  for (const std::string& stage : not_converged) {
    list.push_back({Level::bad, "The stage " + stage + " did not converge: what follows from it is provisional."});
  }
  list.push_back(quality(results.fit));
  for (Finding& doubt : doubts(results)) list.push_back(std::move(doubt));
  for (const std::string& sentence : by_hand) list.push_back({Level::fact, sentence});
  return list;
}

}  // namespace mbtfm::report
