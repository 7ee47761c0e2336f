/// mbtfm-indent: how deep a contracting cell presses into its gel.
#include <algorithm>
#include <cmath>
#include <optional>

#include "continuum/sheet/curve.h"
#include "continuum/solids/outputs.h"
#include "continuum/solids/sweep.h"
#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/report.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/tables.h"
#include "pipeline/files/text.h"
#include "pipeline/stage/help.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"

namespace mbtfm::solids {
namespace {

constexpr double kVolume_um3 = 5000;  ///< where it is not given: of the thesis' cell

struct Parameters {
  Gel gel;
  double radius_um = 100;  ///< of the gel: twice and more what the optimum depends on
  std::optional<double> volume_um3;
  double height_um = 0;
  double youngs_modulus_kPa = 10;
  double poisson_ratio = 0.49;
  double contraction_kPa = 30;
  Strain strain = Strain::small;
  std::string depths_um = "0, 5";
  std::string sweep = {};
  std::optional<int> order, towards_rim;
};

void declare(stage::ParameterList& list, Parameters& p) {
  declare(list, p.gel);
  list.add("radius_um", p.radius_um, Range::thickness_um());
  list.table("cell");
  list.add("volume_um3", p.volume_um3, Range::between(1, 1e7),
           stage::help_on("cell", "volume_um3", {brief(kVolume_um3)}));
  list.add("height_um", p.height_um, Range::zero_or_size_um());
  list.add("youngs_modulus_kPa", p.youngs_modulus_kPa, Range::modulus_kPa());
  list.add("poisson_ratio", p.poisson_ratio, Range{.low = 0, .high = 0.5, .excludes_high = true});
  list.add("contraction_kPa", p.contraction_kPa, Range::between(0, 1e6));
  list.table("indent");
  list.add("strain", p.strain);
  list.add("depths_um", p.depths_um);
  list.add("sweep", p.sweep);
  const auto unset = [](const char* key, int Fineness::*number) {
    return stage::help_on("indent", key,
                          {std::to_string(Fineness{}.*number), std::to_string(kRevolvedFineness.*number)});
  };
  list.add("order", p.order, Range::between(3, 8), unset("order", &Fineness::order));
  list.add("towards_rim", p.towards_rim, Range::between(2, 12), unset("towards_rim", &Fineness::towards_rim));
}

/// @param fineness  of what is not given
Setting setting_of(const Parameters& p, const Fineness& fineness) {
  return {.volume_um3 = p.volume_um3.value_or(kVolume_um3),
          .cell = {p.youngs_modulus_kPa, p.poisson_ratio, p.contraction_kPa},
          .slab = {p.gel.thickness_um, p.radius_um},
          .gel_poisson_ratio = p.gel.poisson_ratio,
          .depths_um = values_in(p.depths_um, "depths_um", Zero::is_allowed),
          .strain = p.strain,
          .fineness = {p.order.value_or(fineness.order), p.towards_rim.value_or(fineness.towards_rim)}};
}

/// @throws UsageError where a value leaves the model
void expect_sense(const Parameters& p, const Setting& setting, const std::vector<Case>& cases) {
  constexpr double kIncompressible = 0.49999;  // 1 - 2 nu = 2e-5: of 16 digits rounding takes ten
  for (const auto& [who, ratio] : {std::pair{"cell", p.poisson_ratio}, std::pair{"gel", p.gel.poisson_ratio}}) {
    if (ratio > kIncompressible)
      throw UsageError(std::string("[") + who + "] poisson_ratio: expected at most 0.49999, found " +
                       significant(ratio, 9) + ". A cell of 1/2 keeps its volume and does not move at all");
  }
  constexpr double kMostContraction = 0.4;  // beyond it the law of St Venant and Kirchhoff softens in compression
  const double free = setting.cell.free_contraction();
  if (free > kMostContraction)
    throw UsageError(
        "[cell] contraction_kPa: expected a contraction without hindrance, (1 - 2 nu) stress / modulus, of at most "
        "0.4, found " +
        brief(free));
  for (const Case& one : cases)
    if (one.height_um == 0)
      throw UsageError("[cell] height_um is missing: give it in cell.toml, as --height_um or in the sweep");
}

void notice_large_contraction(stage::StageContext& context, const Setting& setting) {
  if (setting.strain == Strain::large) return;
  context.notice(noticed(Symptom::contraction_beyond_linear, setting.cell.free_contraction()));
}

Figures figures_of(const Setting& setting, const std::vector<Indentation>& solved) {
  double error = 0, imbalance = 0;
  int iterations = 0;
  std::int64_t n_failed = 0;
  for (const Indentation& one : solved) {
    if (one.failure) {
      ++n_failed;
      continue;
    }
    error = std::max(error, one.error_um / one.reading.largest_u_um);
    imbalance = std::max(imbalance, one.imbalance);
    iterations = std::max(iterations, one.iterations);
  }
  Figures figures = {{"n_cases", static_cast<std::int64_t>(solved.size())},
                     {"strain", std::string(name_of(setting.strain))},
                     {"free_contraction", setting.cell.free_contraction()},
                     {"sphere_height_um", sphere_height_um(setting.volume_um3)},
                     {"hemisphere_height_um", hemisphere_height_um(setting.volume_um3)},
                     {"largest_relative_error", error},
                     {"net_force_over_sum", imbalance},
                     {"newton_iterations", std::int64_t{iterations}}};
  if (n_failed > 0) figures.emplace_back("n_cases_without_equilibrium", n_failed);
  if (solved.size() > 1) return figures;
  const Indentation& one = solved.front();
  for (std::size_t k = 0; k < setting.depths_um.size(); ++k)
    figures.emplace_back("depth_" + shortest(setting.depths_um[k]) + "_um", one.reading.depth_um[k]);
  figures.emplace_back("lift_um", one.reading.lift_um);
  figures.emplace_back("largest_u_um", one.reading.largest_u_um);
  figures.emplace_back("error_um", one.error_um);
  figures.emplace_back("energy_fJ", one.energy_fJ);
  return figures;
}

std::string summary_of(const Setting& setting, const std::vector<Indentation>& solved,
                       const std::vector<Optimum>& optima) {
  if (solved.size() == 1) {
    const Reading& r = solved.front().reading;
    return "presses " + brief(r.depth_um.back()) + " um deep (" + brief(setting.depths_um.back()) +
           " um below the surface), moves by " + brief(r.largest_u_um) + " um at most; error " +
           brief(solved.front().error_um) + " um";
  }
  const auto n_failed = std::ranges::count_if(solved, [](const Indentation& i) { return i.failure.has_value(); });
  return counted(std::ssize(solved), "cases") + ", " +
         (n_failed > 0 ? std::to_string(n_failed) + " of them without an equilibrium, " : std::string()) +
         counted(std::ssize(optima), "best heights");
}

/// Cases that are not solved: all of them, or some of a sweep.
/// @throws NotSolved where none is solved
void notice_failures(stage::StageContext& context, const std::vector<Indentation>& solved) {
  std::vector<const Indentation*> failed;
  for (const Indentation& one : solved)
    if (one.failure) failed.push_back(&one);
  if (failed.empty()) return;
  const Indentation& first = *failed.front();
  if (failed.size() == solved.size()) {
    throw NotSolved({.reason = solved.size() == 1 ? *first.failure
                                                  : "none of " + std::to_string(solved.size()) +
                                                        " cases has an equilibrium; the first: " + *first.failure});
  }
  context.notice(noticed(Symptom::cases_not_solved, static_cast<double>(failed.size()),
                         {.value = std::to_string(failed.size()) + " of " + std::to_string(solved.size()),
                          .at = "first: height " + brief(first.of.height_um) + " um, modulus ratio " +
                                brief(first.of.modulus_ratio) + ": " + *first.failure}));
}

std::vector<Indentation> solved_cases(const Setting& setting, const std::vector<Case>& cases,
                                      stage::StageContext& context) {
  try {
    return indentations(setting, cases, context.threads, context.progress);
  } catch (const InvalidData& error) {
    throw UsageError(error.what());  // of the parameters: no file has them alone
  }
}

Case case_of(const Parameters& p) { return {p.height_um, p.gel.youngs_modulus_kPa / p.youngs_modulus_kPa}; }

StageReport run_round(const Parameters& p, stage::StageContext& context) {
  const Setting setting = setting_of(p, Fineness{});
  const std::vector<Case> cases = cases_of(p.sweep, case_of(p));
  expect_sense(p, setting, cases);
  const std::vector<Indentation> solved = solved_cases(setting, cases, context);
  notice_failures(context, solved);
  const std::vector<Optimum> best = optima(setting, solved, context.threads);
  write_indentations(context.output("out", "indent.csv"), solved, setting.depths_um);
  const auto deepest = std::ranges::max_element(
      solved, {}, [](const Indentation& i) { return i.failure ? -HUGE_VAL : i.reading.depth_um.back(); });
  write_deformed_vtu(context.output("out", "indent.vtu"), deformed_section(setting, deepest->of));
  StageReport report;
  report.converged = std::ranges::none_of(solved, [](const Indentation& i) { return i.failure.has_value(); });
  report.figures = figures_of(setting, solved);
  if (solved.size() > 1) {
    write_optima(context.output("out", "optima.csv"), best);
    files::write_text(context.output("out", "indent.svg"), picture_of(setting, solved, best));
  }
  files::write_figures(context.output("out", "indent.json"), report.figures);
  report.summary = summary_of(setting, solved, best);
  notice_large_contraction(context, setting);
  return report;
}

/// @throws UsageError of what only round cells have
void expect_outline_sense(const Parameters& p) {
  if (!p.sweep.empty())
    throw UsageError("--sweep: expected none with --outline, which is one case; found '" + p.sweep + "'");
  if (p.strain != Strain::small)
    throw UsageError("[indent] strain: expected small with --outline: large strains are for round cells only");
  if (p.volume_um3)
    throw UsageError("[cell] volume_um3: expected none with --outline, found " + brief(*p.volume_um3) +
                     ". The volume follows from the outline and height_um");
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

OutlinedIndentation solved_case(const Setting& setting, const Case& of, const Contact& contact, int threads) {
  try {
    return indentation(setting, of, contact, threads);
  } catch (const InvalidData& error) {
    throw UsageError(error.what());  // of height or depths: the contact has been checked
  }
}

StageReport run_outlined(const Parameters& p, stage::StageContext& context) {
  expect_outline_sense(p);
  Setting setting = setting_of(p, kRevolvedFineness);
  const Case of = case_of(p);
  expect_sense(p, setting, {of});
  const Contact contact = read_contact(context.input("outline"), setting);
  setting.volume_um3 = section_on(contact, of.height_um).volume_um3;
  const OutlinedIndentation solved = solved_case(setting, of, contact, context.threads);
  write_indentations(context.output("out", "indent.csv"), {solved.of}, setting.depths_um);
  write_deformed_vtu(context.output("out", "indent.vtu"), solved.deformed);
  StageReport report;
  report.figures = figures_of(setting, {solved.of});
  const Sectors& sectors = solved.deformed.mesh.sectors;
  report.figures.emplace_back("volume_um3", setting.volume_um3);
  report.figures.emplace_back("n_sectors", std::int64_t{sectors.n()});
  report.figures.emplace_back("outline_off_um", sectors.off_um);
  files::write_figures(context.output("out", "indent.json"), report.figures);
  report.summary = summary_of(setting, {solved.of}, {});
  notice_large_contraction(context, setting);
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
