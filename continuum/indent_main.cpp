/// mbtfm-indent: how deep a contracting cell presses into its gel.
#include <algorithm>
#include <cmath>

#include "continuum/sheet/curve.h"
#include "continuum/solids/outputs.h"
#include "continuum/solids/parameters.h"
#include "continuum/solids/sweep.h"
#include "pipeline/contract/errors.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/tables.h"
#include "pipeline/files/text.h"
#include "pipeline/stage/stage.h"

namespace mbtfm::solids {
namespace {

/// @throws UsageError for InvalidData: of the parameters, as no file has them alone and a contact has been checked
template <class Solve>
auto with_usage(const Solve& solve) {
  try {
    return solve();
  } catch (const InvalidData& error) {
    throw UsageError(error.what());
  }
}

StageReport run_round(const Parameters& p, stage::StageContext& context) {
  const Setting setting = setting_of(p, Fineness{});
  const std::vector<Case> cases = cases_of(p.sweep, case_of(p));
  expect_sense(p, setting, cases);
  const std::vector<Indentation> solved =
      with_usage([&] { return indentations(setting, cases, context.threads, context.progress); });
  notice_failures(context, solved);
  const std::vector<Optimum> best = optima(setting, solved, context.threads);
  write_indentations(context.output("out", "indent.csv"), solved, setting.depths_um);
  const auto deepest = std::ranges::max_element(
      solved, {}, [](const Indentation& i) { return i.failure ? -HUGE_VAL : i.reading.depth_um.back(); });
  write_deformed_vtu(context.output("out", "indent.vtu"), deformed_section(setting, deepest->of));
  if (solved.size() > 1) {
    write_optima(context.output("out", "optima.csv"), best);
    files::write_text(context.output("out", "indent.svg"), picture_of(setting, solved, best));
  }
  StageReport report = report_of(setting, solved, std::ssize(best), context);
  files::write_figures(context.output("out", "indent.json"), report.figures);
  return report;
}

/// The outline of a whole contact, without points that repeat the one before.
Polygon read_whole_outline(const Path& file) {
  Polygon outline;
  for (const files::OutlinePoint& point : files::read(file, files::outline_table())) {
    if (point.ring != 0)
      throw InputError(file.string(), "one ring: a contact without holes", "a second ring",
                       "leave out the rows of ring 1 and more");
    if (point.is_cut)
      throw InputError(file.string(), "the outline of a whole contact", "one that the image cuts (is_cut)",
                       "take a cell that is in the image as a whole: what lies beyond also pulls");
    if (outline.empty() || !(outline.back() == point.position_um)) outline.push_back(point.position_um);
  }
  while (outline.size() > 1 && outline.front() == outline.back()) outline.pop_back();
  return outline;
}

/// @throws InputError where it is no contact for this slab
Contact read_contact(const Path& file, const Setting& setting) {
  const Polygon outline = read_whole_outline(file);
  constexpr double kLeast_um2 = 1e-3;
  if (outline.size() < 3 || !(std::abs(signed_area_um2(outline)) > kLeast_um2))
    throw InputError(file.string(), "an outline around an area", "one around none");
  const std::string crossing = sheet::crossing_of({outline});
  if (!crossing.empty())
    throw InputError(file.string(), "an outline that does not cross itself", crossing + " cross",
                     "remove the loop, or draw the outline again");
  try {
    Contact contact(outline);
    expect_on_slab(contact, setting.slab);
    sectors_of(contact, setting.fineness.order);
    return contact;
  } catch (const InvalidData& error) {
    throw InputError(file.string(), error.expected, error.found,
                     "check that it is in um; smooth the outline (convex hull), or take a larger radius_um");
  }
}

StageReport run_outlined(const Parameters& p, stage::StageContext& context) {
  expect_outline_sense(p);
  Setting setting = setting_of(p, kRevolvedFineness);
  const Case of = case_of(p);
  expect_sense(p, setting, {of});
  const Contact contact = read_contact(context.input("outline"), setting);
  setting.volume_um3 = section_on(contact, of.height_um).volume_um3;
  const OutlinedIndentation solved = with_usage([&] { return indentation(setting, of, contact, context.threads); });
  write_indentations(context.output("out", "indent.csv"), {solved.of}, setting.depths_um);
  write_deformed_vtu(context.output("out", "indent.vtu"), solved.deformed);
  StageReport report = report_of(setting, {solved.of}, 0, context);
  const Sectors& sectors = solved.deformed.mesh.sectors;
  report.figures.emplace_back("volume_um3", setting.volume_um3);
  report.figures.emplace_back("n_sectors", std::int64_t{sectors.n()});
  report.figures.emplace_back("outline_off_um", sectors.off_um);
  files::write_figures(context.output("out", "indent.json"), report.figures);
  return report;
}

StageReport run(const Parameters& p, stage::StageContext& context) {
  return context.has_input("outline") ? run_outlined(p, context) : run_round(p, context);
}

}  // namespace
}  // namespace mbtfm::solids

int main(int argc, char** argv) {
  using Kind = mbtfm::stage::FileArgument::Kind;
  using namespace mbtfm::solids;
  return mbtfm::stage::run_stage<Parameters>(
      {.name = "indent", .files = {{"outline", Kind::optional_input}, {"out", Kind::output_folder}}}, argc, argv, run);
}
