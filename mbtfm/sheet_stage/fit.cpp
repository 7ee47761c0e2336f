#include <algorithm>
#include <memory>
#include <set>

#include "continuum/sheet/mesh_size.h"
#include "continuum/sheet/recovery.h"
#include "mbtfm/sheet_stage/runs.h"
#include "mbtfm/sheets/bead_fit.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tractions/neighbour_noise.h"
#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/with_error.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/tables.h"
#include "pipeline/stage/effects.h"

namespace mbtfm::sheet_stage {
namespace {

/// Beads without flags, and with an error each if any neighbours show it.
DisplacementField read_beads(stage::StageContext& context) {
  DisplacementField beads = files::read_displacement(context.input("displacement"));
  std::erase_if(beads, [](const Bead& bead) { return !bead.flag.empty(); });
  context.expect_plausible("beads_per_um2", beads_per_um2(beads));
  if (const auto sigma_um = tractions::assume_noise_um(beads))
    context.assumed.push_back(stage::assumed_noise(*sigma_um));
  return beads;
}

tensions::LinearData data_of_adhesions(const DisplacementField& beads, stage::StageContext& context,
                                       const substrate::Substrate& model, bool has_motion) {
  const auto ellipses = substrate::ellipses_of(files::read_adhesions(context.input("adhesions")));
  return tensions::reduce(beads, substrate::dense_response(model.compliance_um_per_nN(points_of(beads), ellipses), 1),
                          {}, 1, has_motion ? tensions::affine_motions(beads) : MatrixXd());
}

std::string sentence_of(const SheetEstimate& e) {
  const std::string quantity = for_people(e.quantity).name, of = for_people(e.quantity).unit,
                    unit = of.empty() ? "" : " " + of;
  const std::string name =
      e.part == kMeanPart ? "mean " + quantity : quantity + (e.part.empty() ? "" : " of " + e.part);
  if (is_given(e)) return name + " " + brief(e.value) + unit + " (given)";
  if (e.identifiable) return name + " " + brief(e.value) + unit + " (" + brief(*e.low) + " to " + brief(*e.high) + ")";
  if (e.low) return name + " > " + brief(*e.low) + unit;
  if (e.high) return name + " < " + brief(*e.high) + unit;
  return name + " not known";
}

/// The same of a contraction that varies: where its interval holds none.
void notice_expansion(stage::StageContext& context, const std::vector<sheets::ContractionAt>& field) {
  const auto least = std::ranges::min_element(field, {}, &sheets::ContractionAt::high_nN_per_um);
  const auto n_below = std::ranges::count_if(field, [](const auto& at) { return at.high_nN_per_um < 0; });
  const double share = static_cast<double>(n_below) / static_cast<double>(field.size());
  context.notice(noticed(Symptom::sheet_expands, share,
                         {.at = brief(100 * share) + " % of its nodes, most at (" + brief(least->position_um.x) + ", " +
                                brief(least->position_um.y) + ") um, with " +
                                with_error(least->nN_per_um, least->sigma_nN_per_um) + " nN/µm"}));
}

void notice_expansion(stage::StageContext& context, const sheets::SheetFit& fit, int n_parts) {
  const std::vector<sheets::FittedEstimate> found = expanding(fit);
  std::string text;
  bool is_sure = false;  // the interval holds no contraction
  for (const SheetEstimate& e : found) {
    const bool is_below = e.high && *e.high < 0;
    is_sure = is_sure || is_below;
    text += std::string(text.empty() ? "" : "; ") + (e.part.empty() ? std::string("contraction") : e.part) + " " +
            brief(e.value) + " nN/µm" +
            (e.low && e.high ? " (" + brief(*e.low) + " to " + brief(*e.high) + ")" : std::string());
  }
  context.notice(noticed(Symptom::sheet_expands, static_cast<double>(found.size()) / n_parts,
                         {.at = text, .severity = is_sure ? Severity::bad : Severity::caution}));
}

/// What the beads do and the sheet does not.
void notice_unexplained(stage::StageContext& context, const sheets::SheetFit& fit, const sheets::Misfit& misfit) {
  if (!fit.expected_relative_l2) return;
  constexpr double kLittle = 0.4;  // as the tension fit has it: the symptom explains_little
  const double left = fit.relative_l2 * fit.relative_l2, noise = *fit.expected_relative_l2 * *fit.expected_relative_l2;
  const double share = noise < 1 ? std::max(0.0, left - noise) / (1 - noise) : 0;
  const sheets::Statistic &chi = misfit.chi_squared_per_degree, &alike = misfit.correlation;
  context.notice(
      noticed(Symptom::sheet_unexplained, misfit.excess(),
              {.at = "chi² per degree of freedom " + with_error(chi.value, chi.sigma) + ", correlation of near beads " +
                     with_error(alike.value, alike.sigma) +
                     (share > kLittle ? "; " + brief(100 * (1 - share)) + " % of the displacement is explained" : ""),
               .severity = share > kLittle ? Severity::bad : Severity::caution}));
}

void add_figures_of(const sheets::FieldFit& field, Figures& figures) {
  figures.emplace_back("contraction_degrees", field.degrees);
  figures.emplace_back("contraction_smoothing_um2_per_nN2", field.smoothing);
  figures.emplace_back("contraction_is_as_smooth_as_tried", field.is_smoothing_at_end);
}

std::vector<sheets::Part> parts_of_cells(const Parameters& p, stage::StageContext& context) {
  if (!context.has_input("cells")) throw UsageError("fit_parts = cells needs --cells");
  const auto cells = std::make_shared<const CellLabels>(read_labels(context.input("cells"), p.pixel_size_um));
  std::set<int> labels(cells->labels.begin(), cells->labels.end());
  labels.erase(0);
  constexpr std::size_t kMost = 30;  // a solution for each at each of 20 stiffnesses
  if (labels.size() > kMost)
    throw InputError(context.input("cells").string(), "at most 30 cells with contractions of their own",
                     std::to_string(labels.size()), "join cells, or take fit_parts = edge");
  std::vector<sheets::Part> parts;
  for (const int label : labels)
    parts.push_back(
        {"cell " + std::to_string(label), [=](Vec2 place) { return cells->at_um(place) == label ? 1.0 : 0.0; }});
  parts.push_back({"no cell", [=](Vec2 place) { return cells->at_um(place) == 0 ? 1.0 : 0.0; }});
  return parts;
}

std::vector<sheets::Part> parts_of(const Parameters& p, stage::StageContext& context, const Region& region) {
  if (p.fit_parts == Parts::cells) return parts_of_cells(p, context);
  if (p.fit_parts == Parts::none || p.fit_parts == Parts::field) return {};
  if (!p.sheet.edge_band_um) throw UsageError("[sheet] edge_band_um is missing: fit_parts = edge needs it");
  const auto is_edge = [rims = region.rims, band = *p.sheet.edge_band_um](Vec2 place) {
    return std::ranges::any_of(
        rims, [&](const Curve& rim) { return distance_to_boundary_um(rim.points_um(), place) <= band; });
  };
  return {{"inside", [=](Vec2 place) { return is_edge(place) ? 0.0 : 1.0; }},
          {"edge", [=](Vec2 place) { return is_edge(place) ? 1.0 : 0.0; }}};
}

std::vector<Bundle> read_bundles(stage::StageContext& context) {
  std::vector<Bundle> bundles;
  if (!context.has_input("bundles")) return bundles;
  for (const files::FibrePoint& point : files::read(context.input("bundles"), files::fibre_point_table())) {
    if (bundles.empty() || bundles.back().fibre_id != point.fibre_id) bundles.push_back({point.fibre_id, {}});
    bundles.back().points_um.push_back(point.position_um);
  }
  return bundles;
}

/// @throws UsageError where what is given is what is asked for
void check_fit(const Parameters& p) {
  if (!p.gel_modulus_kPa) throw UsageError("[gel] youngs_modulus_kPa is missing: the beads move with the gel");
  if (p.sheet.ground && *p.sheet.ground != Ground::gel)
    throw UsageError("with --displacement leave ground out, or set ground = gel");
  if (p.sheet.strain == Strain::large)
    throw UsageError(
        "with --displacement strains are small. Leave strain out, and run the fitted sheet with strain = large to see "
        "the difference");
  if (p.sheet.contraction_nN_per_um || p.sheet.contraction_kPa)
    throw UsageError("--displacement fits the contraction: leave contraction_nN_per_um and contraction_kPa out");
  if (p.sheet.line_tension_nN > 0)
    throw UsageError("--displacement fits the line tension (fit_line_tension): leave line_tension_nN out");
  if (p.fit_adhesion_stiffness && p.sheet.adhesion_stiffness_nN_per_um3)
    throw UsageError("give either fit_adhesion_stiffness or adhesion_stiffness_nN_per_um3");
  if (p.fit_adhesion_stiffness && p.fit_parts == Parts::field)
    throw UsageError("fit_parts = field needs a known bond: leave fit_adhesion_stiffness out");
  if (!p.sheet.thickness_um) throw UsageError("[sheet] thickness_um is missing: give it in cell.toml");
}

sheets::Question question_of(const Parameters& p, stage::StageContext& context, const Region& region,
                             double usual_outline_error_um) {
  Scene scene;
  scene.adhesive_um = adhesive_area(p, context, region);
  scene.region = with_borders_of(region, scene.adhesive_um);
  scene.material = {1, p.sheet.poisson_ratio, *p.sheet.thickness_um};
  scene.contraction = {1, p.sheet.edge_band_um, {}};
  scene.adhesion_nN_per_um3 = p.sheet.adhesion_stiffness_nN_per_um3;
  scene.size = size_for_fit(region);
  if (p.sheet.mesh_um) scene.size = with_edge(scene.size, *p.sheet.mesh_um);
  sheets::Question q{.scene = std::move(scene),
                     .parts = parts_of(p, context, region),
                     .has_line = p.fit_line_tension,
                     .bundles = read_bundles(context),
                     .bond = p.fit_adhesion_stiffness ? sheets::Bond::fitted : sheets::Bond::known,
                     .loss = p.loss,
                     .has_motion = tensions::allows_common_motion(p.substrate.effects),
                     .outline_error_um = p.outline_error_um.value_or(usual_outline_error_um),
                     .under_load = p.substrate.effects.beads_under_load,
                     .tolerance = p.substrate.effects.effect_tolerance};
  if (p.fit_parts == Parts::field) q.field_points = p.field_points;
  if (p.sheet.youngs_modulus_kPa)
    q.stiffness_nN_per_um =
        Material{*p.sheet.youngs_modulus_kPa, p.sheet.poisson_ratio, *p.sheet.thickness_um}.stiffness_nN_per_um();
  return q;
}

/// "contraction 1.8 nN/µm (1.7 to 1.9); …"
std::string fitted_numbers(const sheets::SheetFit& fit) {
  std::string fitted;
  std::vector<double> bundles_nN;
  for (const SheetEstimate& e : fit.estimates)
    if (e.quantity == sheets::Quantity::bundle_tension)
      bundles_nN.push_back(e.value);
    else
      fitted += (fitted.empty() ? "" : "; ") + sentence_of(e);
  if (bundles_nN.empty()) return fitted;
  const auto [least, most] = std::ranges::minmax(bundles_nN);  // sheet_fit.csv has each
  return fitted +
         (bundles_nN.size() == 1 ? "; tension of a bundle " + brief(least)
                                 : "; tensions of " + counted(std::ssize(bundles_nN), "bundles") + " " + brief(least) +
                                       " to " + brief(most)) +
         " nN";
}

/// What a reader must know of the fit.
void notice_fit(stage::StageContext& context, const sheets::BeadFit& found, const std::string& fitted) {
  const sheets::SheetFit& fit = found.fit;
  const auto stiffness = std::ranges::find(fit.estimates, sheets::Quantity::stiffness, &SheetEstimate::quantity);
  context.notice(noticed(Symptom::sheet_not_identifiable, stiffness->identifiable ? 0 : 1, {.at = fitted}));
  notice_unexplained(context, fit, found.misfit);
  if (!found.field) notice_expansion(context, fit, found.n_parts);
  context.notice(
      noticed(Symptom::sheet_at_bound, fit.is_at_bound ? 1 : 0, {.value = brief(fit.stiffnesses.sheet_nN_per_um)}));
}

}  // namespace

Run run_fit(const Parameters& p, stage::StageContext& context, const Region& region, double usual_outline_error_um) {
  check_fit(p);
  Gel gel = p.gel;
  gel.youngs_modulus_kPa = *p.gel_modulus_kPa;
  check(gel);
  const sheets::GelModels models{
      .usual = [&](const Gel& of) { return choice::make_substrate(of, p.substrate, context.threads); },
      .with_base =
          [&](const Gel& of) {
            substrate::SubstrateParameters layer = p.substrate;
            layer.model = substrate::ModelKind::layer;
            return choice::make_substrate(of, layer, context.threads);
          }};
  const auto model = models.usual(gel);
  const sheets::Question question = question_of(p, context, region, usual_outline_error_um);
  const DisplacementField beads = read_beads(context);
  sheets::BeadFit found = fit_beads(question, beads, gel, *model, models, context.threads,
                                    [&](double share, const char* doing) { context.progress(share, doing); });
  sheets::SheetFit& fit = found.fit;
  const Scene& scene = found.scene;
  if (context.has_input("adhesions"))
    compare_with_adhesions(fit, data_of_adhesions(found.beads, context, *model, question.has_motion));
  Run result{.solution = std::move(found.solution), .figures = {}, .effects = effects_of(*model)};
  write_beads(context, *model, result.solution, points_of(beads), points_of(found.beads));
  const Path estimates_file = context.output("out", "sheet_fit.csv"),
             models_file = context.output("out", "sheet_models.csv");
  write_estimates(estimates_file, fit);
  write_models(models_file, fit);
  if (found.field) {
    const std::vector<sheets::ContractionAt> at_nodes =
        contractions_at(*result.solution.elements, *found.lattice, *found.field);
    write_contractions(context.output("out", "contraction.csv"), at_nodes);
    notice_expansion(context, at_nodes);
  }
  result.fitted = fitted_numbers(fit);
  result.tables = report::tables_of_sheet(estimates_file, models_file);
  result.varied = found.varied;
  notice_fit(context, found, result.fitted);
  result.figures = {{"ground", std::string(name_of(Ground::gel))},
                    {"strain", std::string(name_of(Strain::small))},
                    {"stiffness_nN_per_um", fit.stiffnesses.sheet_nN_per_um},
                    {"contraction_nN_per_um", scene.contraction.nN_per_um},
                    {"youngs_modulus_kPa", scene.material.youngs_modulus_kPa},
                    {"fitted", result.fitted},
                    {"correlation", fit.correlation},
                    {"relative_l2", fit.relative_l2},
                    {"expected_relative_l2", fit.expected_relative_l2.value_or(fit.relative_l2)},
                    {"outline_error_um", question.outline_error_um},
                    {"chi_squared_per_degree", found.misfit.chi_squared_per_degree.value},
                    {"residual_correlation", found.misfit.correlation.value},
                    {"misfit_in_standard_deviations", found.misfit.excess()},
                    {"n_beads", std::int64_t{fit.n_beads}},
                    {"n_down_weighted", std::int64_t{fit.n_down_weighted}},
                    {"aic", fit.models[fit.own_model].aic},
                    {"aic_of_nothing", fit.models.front().aic}};
  if (found.field) add_figures_of(*found.field, result.figures);
  const double x = free_contraction(scene.material, scene.contraction.nN_per_um);
  result.effects.push_back(stage::decided(EffectKind::gel_response, Switch::on, true, "the beads move with the gel"));
  result.effects.push_back(stage::decided(EffectKind::common_motion, switched(question.has_motion), question.has_motion,
                                          "shift, turn, growth and shear of all beads are found with the sheet"));
  result.effects.push_back(found.under_load);
  result.effects.push_back(stage::decided(EffectKind::large_strain, Switch::off, x, kLargestStrain,
                                          "the fit is linear in the contraction; a free sheet would contract by"));
  result.effects.push_back(third_dimension(context, scene.material, region));
  context.notice(noticed(Symptom::contraction_beyond_linear, x));
  return result;
}

}  // namespace mbtfm::sheet_stage
