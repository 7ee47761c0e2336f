#include <algorithm>
#include <functional>

#include "continuum/sheet/mesh_size.h"
#include "mbtfm/sheet_stage/runs.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/tables.h"

namespace mbtfm::sheet_stage {
namespace {

/// What is known of adhesions' tractions holds of a colony's, which are weaker: pascals in the columns of kPa are seen.
std::optional<stage::Doubt> doubt_about_tractions(const std::vector<GroundPatch>& patches) {
  std::vector<stage::Load> loads;
  for (const GroundPatch& p : patches) loads.push_back({norm(p.traction_kPa), norm(p.traction_kPa) * p.area_um2});
  std::optional<stage::Doubt> doubt =
      stage::doubt_about("traction_kPa", stage::traction_of_half_the_force_kPa(std::move(loads)));
  if (!doubt) return doubt;
  doubt->quantity = "traction where half of the force is borne";
  doubt->remedy = "check the unit of tx_kPa and ty_kPa: 200 Pa are 0.2 kPa";
  return doubt;
}

/// Where the sheet ends.
Region area_around(const Region& region, stage::StageContext& context, const Parameters& p) {
  if (context.has_input("area")) return region_of(outlines::read_rings(context.input("area"), p.pixel_size_um));
  return region;
}

/// What the edge along the cuts makes of the tensions: with that held, clamped or free.
Figures report_cut(stage::StageContext& context, const Region& area, const Polygon& outline, const Solution& held,
                   const CutPull& cut, const std::function<FromTraction(CutEdge)>& with) {
  constexpr double kSame = 0.05;  // of the mean tension
  const FromTraction clamped = with(CutEdge::clamped), free = with(CutEdge::free);
  const double mean = figures_inside(held, outline).mean_nN_per_um,
               of_clamped = figures_inside(clamped.solution, outline).mean_nN_per_um,
               of_free = figures_inside(free.solution, outline).mean_nN_per_um;
  const double reach = reach_of_cuts_um(held, clamped.solution, area.cuts, kSame * std::abs(mean));
  context.notice(noticed(Symptom::sheet_cut, std::abs(of_clamped - mean) / std::abs(mean)));
  return {{"cut_length_um", cut.length_um},
          {"cut_pull_nN", norm(cut.force_nN)},
          {"cut_reach_um", reach},
          {"inside_mean_tension_cut_clamped_nN_per_um", of_clamped},
          {"inside_mean_tension_cut_free_nN_per_um", of_free}};
}

}  // namespace

Run run_from_traction(const Parameters& p, stage::StageContext& context, const Region& region) {
  if (p.sheet.ground && *p.sheet.ground != Ground::none)
    throw UsageError("leave ground out with --traction, or set ground = none");
  if (p.sheet.strain == Strain::large) throw UsageError("strain = large needs a given contraction, not --traction");
  context.assumed.clear();  // of a gel: none takes part
  const std::vector<GroundPatch> tractions = files::read_tractions(context.input("traction"));
  context.doubt(doubt_about_tractions(tractions), context.input("traction").string() + ": tractions");
  const Region area = area_around(region, context, p);
  // any modulus gives the same tensions
  const Material material{p.sheet.youngs_modulus_kPa.value_or(1), p.sheet.poisson_ratio,
                          p.sheet.thickness_um.value_or(1)};
  TriangleSize size = size_for_tractions(area, tractions);
  if (p.sheet.mesh_um) size = with_edge(size, *p.sheet.mesh_um);
  context.progress(0.1, "solving for the tensions");
  std::optional<TractionNoise> noise;
  if (p.traction_sigma_kPa)
    noise = {*p.traction_sigma_kPa, p.traction_correlation_um.value_or(std::sqrt(tractions.front().area_um2))};
  FromTraction found = tensions_from(tractions, area, material, size, context.threads, p.most_unbalanced, noise);
  const Polygon& outline = region.rims.front().points_um();
  const TensionFigures inside = figures_inside(found.solution, outline);
  Run result{.solution = std::move(found.solution), .figures = {}, .effects = {}};
  result.figures = {{"ground", std::string(name_of(Ground::none))},
                    {"inside_mean_tension_nN_per_um", inside.mean_nN_per_um},
                    {"inside_variation", inside.variation},
                    {"inside_shear_nN_per_um", inside.shear_nN_per_um},
                    {"inside_area_um2", inside.area_um2},
                    {"net_force_share", found.unbalanced.net_force_share},
                    {"net_torque_share", found.unbalanced.net_torque_share},
                    {"outside_share", found.unbalanced.outside_share},
                    {"exact_virial_tension_nN_per_um", found.balance.virial_tension_nN_per_um}};
  result.balance = found.balance;
  if (found.errors) {
    result.figures.emplace_back("mean_tension_sigma_nN_per_um", found.errors->mean_nN_per_um);
    result.solution.sigma_by_triangle = found.errors->by_triangle;
  }
  // what Poisson's ratio, which nobody knows, makes of it
  for (const double nu : {0.0, 0.5}) {
    const Material other{material.youngs_modulus_kPa, nu, material.thickness_um};
    const FromTraction with_nu = tensions_from(tractions, area, other, size, context.threads, p.most_unbalanced);
    result.figures.emplace_back(nu == 0 ? "inside_mean_tension_nu_0_nN_per_um" : "inside_mean_tension_nu_05_nN_per_um",
                                figures_inside(with_nu.solution, outline).mean_nN_per_um);
  }
  if (found.cut) {
    const auto with = [&](CutEdge edge) {
      return tensions_from(tractions, area, material, size, context.threads, 1, {}, edge);
    };
    std::ranges::copy(report_cut(context, area, outline, result.solution, *found.cut, with),
                      std::back_inserter(result.figures));
  }
  const double mean = found.balance.mean_tension_nN_per_um;
  context.notice(noticed(Symptom::sheet_expands, mean < 0 ? 1 : 0, {.at = "mean tension " + brief(mean) + " nN/µm"}));
  const double worst = std::max(found.unbalanced.net_force_share, found.unbalanced.net_torque_share);
  context.notice(noticed(Symptom::tractions_off_balance, worst));
  context.notice(noticed(Symptom::tractions_outside, found.unbalanced.outside_share));
  return result;
}

}  // namespace mbtfm::sheet_stage
