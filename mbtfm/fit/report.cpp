#include "mbtfm/fit/report.h"

#include <algorithm>

#include "mbtfm/fit/checks.h"
#include "mbtfm/fit/fit_cell.h"
#include "mbtfm/tensions/findings.h"
#include "mbtfm/tensions/fit_results.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/listed.h"
#include "pipeline/contract/numbers.h"

namespace mbtfm::fit {

using namespace tensions;

namespace {

std::string of_series(const std::vector<FrameFit>& frames) {
  if (frames.empty()) return "";
  const auto n_refused = std::ranges::count_if(frames, [](const FrameFit& f) { return !f.refused.empty(); });
  return "; " + std::to_string(frames.size()) + " frames" +
         (n_refused > 0 ? ", " + std::to_string(n_refused) + " of them without a fit (see frames.csv)" : "");
}

std::string summary_line(const FittedCell& cell) {
  if (!cell.fit.report.converged) return cell.fit.report.reason;
  const std::vector<Tension>& tensions = cell.found.tensions;
  std::string line = std::to_string(tensions.size() - 1) + " fibre tensions, total force " +
                     brief(cell.found.summary.total_force_nN) + " nN, relative L2 " +
                     brief(cell.found.summary.relative_l2) + of_series(cell.frames);
  const std::vector<std::string> together = names_of_groups(cell.fit);
  if (!together.empty()) line += "; not told apart, but their sum: fibres " + listed(together);
  const auto n_unidentifiable = std::ranges::count(tensions, false, &Tension::identifiable);
  if (n_unidentifiable > 0)
    line += "; " + std::to_string(n_unidentifiable) + (n_unidentifiable == 1 ? " tension" : " tensions") +
            " not identifiable";
  const int n_flagged = cell.ready.scene.n_flagged;
  if (n_flagged > 0) line += "; " + std::to_string(n_flagged) + " flagged beads left out";
  return line;
}

std::vector<Finding> all_findings(const FittedCell& c) {
  std::vector<Finding> findings =
      findings_of({c.fit, c.fit.data, c.seen, c.found.summary, c.found.tensions, c.checks.missing_fibres,
                   c.checks.missing_adhesions, c.motions.common, c.motions.curved, c.motions.placement, c.ready.beyond,
                   c.ready.decisions.strain,
                   has_far_beads(c.fit.data, c.ready.scene.cell.outline_um, c.parameters.fit.far_distance_um)});
  for (const auto& [symptom, reading] :
       {std::pair(Symptom::field_smoothed, c.smoothing), std::pair(Symptom::read_otherwise, c.reading)}) {
    if (!reading) continue;
    if (auto found = noticed_reading(symptom, *reading)) findings.insert(findings.begin(), std::move(*found));
  }
  if (!c.parameters.gel.youngs_modulus_sigma_kPa)
    findings.insert(findings.begin(), *noticed(Symptom::modulus_error_unknown, 1));
  return findings;
}

}  // namespace

StageReport report_of(const FittedCell& cell) {
  StageReport report{.converged = cell.fit.report.converged,
                     .summary = summary_line(cell),
                     .figures = cell.found.summary.more,
                     .effects = cell.effects,
                     .findings = all_findings(cell)};
  report.figures.emplace_back("error_budget_s", cell.found.budget_s);
  for (const auto& figure : cell.ready.gel->figures()) report.figures.push_back(figure);
  return report;
}

}  // namespace mbtfm::fit
