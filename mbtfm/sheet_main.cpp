/// mbtfm-sheet: contracting sheets and colonies on their ground, and tensions from tractions.
#include <algorithm>
#include "continuum/sheet/recovery.h"

#include "mbtfm/sheet_stage/runs.h"
#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/fit_summary.h"

namespace mbtfm::sheet_stage {
namespace {

StageReport run(const Parameters& p, stage::StageContext& context) {
  context.progress(0, "reading");
  const Path outline = context.input("outline");
  const Region region = region_of(outlines::read_rings(outline, p.pixel_size_um));
  const bool has_tractions = context.has_input("traction");
  if (p.sheet.ground == Ground::none && !has_tractions) throw UsageError("ground = none needs --traction");
  const bool has_beads = context.has_input("displacement");
  if (has_beads && has_tractions) throw UsageError("expected --displacement or --traction, not both");
  if (context.has_input("beads") && (has_beads || has_tractions))
    throw UsageError("--beads needs a given contraction: leave --displacement and --traction out");
  if (context.has_input("area") && !has_tractions) throw UsageError("--area needs --traction");
  if (context.has_input("contractions") && (has_beads || has_tractions))
    throw UsageError("--contractions needs a given contraction: leave --displacement and --traction out");
  if (context.has_input("adhesive") && has_tractions)
    throw UsageError("--adhesive is for springs or a gel: leave it out with --traction");
  if (context.has_input("bundles") && !has_beads) throw UsageError("--bundles needs --displacement");
  if (context.has_input("adhesions") && !has_beads) throw UsageError("--adhesions needs --displacement");
  Run done = has_tractions ? run_from_traction(p, context, region)
             : has_beads   ? run_fit(p, context, region, outlines::usual_error_um(outline, p.pixel_size_um))
                           : run_forward(p, context, region);
  const Balance balance = done.balance.value_or(balance_of(done.solution));
  const std::size_t n_outside = write_solution(context, done.solution);
  std::ranges::copy(figures_of(done.solution, balance), std::back_inserter(done.figures));
  std::ranges::copy(write_cells(context, done.solution, p.pixel_size_um), std::back_inserter(done.figures));
  files::write_figures(context.output("out", "sheet.json"), done.figures);
  const Solution& found = done.solution;
  context.notice(noticed(Symptom::sheet_coarse, relative_error(*found.elements, found.at_points, found.at_nodes)));
  write_page(context, done, balance);
  context.progress(1, "done");

  StageReport report;
  report.converged = done.solution.report.converged;
  report.summary = std::to_string(done.solution.elements->n_triangles()) + " triangles, mean tension " +
                   brief(balance.mean_tension_nN_per_um) + " nN/µm over " + brief(balance.area_um2) +
                   " µm², total force " + brief(balance.total_force_nN) + " nN; " + done.solution.report.reason;
  if (!done.fitted.empty()) report.summary += "; " + done.fitted;
  if (!region.cuts.empty() && !has_tractions)
    report.summary += "; WARNING: the image cuts the sheet, whose edge there counts as free";
  if (n_outside > 0) report.summary += "; " + counted(n_outside, "point lies", "points lie") + " outside of the sheet";
  report.figures = done.figures;
  report.effects = done.effects;
  return report;
}

}  // namespace
}  // namespace mbtfm::sheet_stage

int main(int argc, char** argv) {
  using Kind = mbtfm::stage::FileArgument::Kind;
  using namespace mbtfm::sheet_stage;
  return mbtfm::stage::run_stage<Parameters>({.name = "sheet",
                                              .files = {{"outline", Kind::input},
                                                        {"traction", Kind::optional_input},
                                                        {"displacement", Kind::optional_input},
                                                        {"adhesions", Kind::optional_input},
                                                        {"bundles", Kind::optional_input},
                                                        {"beads", Kind::optional_input},
                                                        {"cells", Kind::optional_input},
                                                        {"contractions", Kind::optional_input},
                                                        {"adhesive", Kind::optional_input},
                                                        {"area", Kind::optional_input},
                                                        {"points", Kind::optional_input},
                                                        {"out", Kind::output_folder}}},
                                             argc, argv, run);
}
