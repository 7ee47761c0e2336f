/// mbtfm-sheet: contracting sheets and colonies on their ground, and tensions from tractions.
#include <algorithm>
#include <map>
#include <memory>
#include <set>

#include "continuum/outlines/rings.h"
#include "continuum/sheet/borders.h"
#include "continuum/sheet/decide.h"
#include "continuum/sheet/from_traction.h"
#include "continuum/sheet/mesh_size.h"
#include "continuum/sheet/parameters.h"
#include "continuum/sheet/picture.h"
#include "continuum/sheet/recovery.h"
#include "continuum/sheet/tables.h"
#include "mbtfm/sheets/bead_fit.h"
#include "mbtfm/sheets/tables.h"
#include "mbtfm/tensions/common_motion.h"
#include "mbtfm/tensions/fit_results.h"
#include "mbtfm/tractions/neighbour_noise.h"
#include "mbtfm/tractions/traction.h"
#include "pipeline/charts/chart.h"
#include "pipeline/contract/counted.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/with_error.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/fit_summary.h"
#include "pipeline/files/tables.h"
#include "pipeline/files/text.h"
#include "pipeline/report/stage_page.h"
#include "pipeline/stage/effects.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"
#include "segment/cells/mask.h"
#include "substrate/choice/factory.h"

namespace mbtfm::sheet {
namespace {

using outlines::read_rings;
using outlines::Rings;

/// Which parts of a sheet have a contraction of their own.
enum class Parts { none, edge, cells, field };
constexpr auto words(Parts) { return std::array{"none", "edge", "cells", "field"}; }

struct Parameters {
  std::optional<double> pixel_size_um;
  std::optional<double> gel_modulus_kPa;  ///< unset: there is no gel
  Gel gel;
  substrate::SubstrateParameters substrate;
  SheetParameters sheet;
  double most_unbalanced = kMostUnbalanced;
  std::optional<double> traction_sigma_kPa, traction_correlation_um;
  Parts fit_parts = Parts::none;                  ///< the simplest
  int field_points = 40;                          ///< of a colony's beads tell fewer numbers
  bool fit_line_tension = false;                  ///< most colonies have none
  bool fit_adhesion_stiffness = false;            ///< few beads tell it beside the sheet's own
  std::optional<double> outline_error_um;         ///< unset: by its source
  tensions::Loss loss = tensions::Loss::squares;  ///< beads are Gaussian to first order
};

void declare(stage::ParameterList& list, Parameters& p) {
  list.add("pixel_size_um", p.pixel_size_um, Range::pixel_um(),
           "side of a pixel of an outline that is a mask or a selection (um)");
  declare(list, p.gel);
  stage::Parameter& modulus = parameter_named(list, "youngs_modulus_kPa");
  modulus.member = &p.gel_modulus_kPa;
  modulus.is_required = false;
  modulus.default_value = "";
  modulus.meaning += "; unset: springs, or nothing, carry the sheet";
  declare(list, p.substrate);
  declare(list, p.substrate.effects,
          {"finite_thickness", "finite_sides", "depth_graded_gel", "common_motion", "beads_under_load",
           "effect_tolerance"});
  parameter_named(list, "beads_under_load").meaning =
      "with --displacement: use the beads' positions under load, as the images show the outline; auto: off";
  declare(list, p.sheet);
  list.add("most_unbalanced", p.most_unbalanced, Range::between(0, 1),
           "with --traction: largest share of net force or torque that is corrected; more is an error");
  list.add("traction_sigma_kPa", p.traction_sigma_kPa, Range::between(0, 1e4),
           "with --traction: standard error of a traction component (kPa), for the tensions' errors; unset: none");
  list.add("traction_correlation_um", p.traction_correlation_um, Range::size_um(),
           "with --traction: resolution, within which neighbours share their error (um); unset: none do");
  list.add("fit_parts", p.fit_parts,
           "with --displacement: parts with their own contraction: none; edge: a band of edge_band_um and the inside; "
           "cells: each cell of --cells; field: a smooth variation, as the beads require");
  list.add("field_points", p.field_points, Range::between(4, 200),
           "with fit_parts = field: approximate number of nodes of the bilinear contraction");
  list.add("fit_line_tension", p.fit_line_tension, "with --displacement: also fit line_tension_nN");
  list.add("fit_adhesion_stiffness", p.fit_adhesion_stiffness,
           "with --displacement: also fit adhesion_stiffness_nN_per_um3");
  list.add("outline_error_um", p.outline_error_um, Range::zero_or_size_um(),
           "with --displacement: standard error of the outline's position (um), part of the intervals; unset: 0.05 if "
           "segmented or from a table, a pixel of a mask, 0.5 if drawn");
  list.add("loss", p.loss, "with --displacement: loss function of the residuals; all but squares downweight outliers");
}

// --- inputs

Region region_of(const Rings& rings) {
  Region region;
  for (const Polygon& ring : rings.points_um) region.rims.emplace_back(ring);
  region.cuts = rings.cuts;
  return region;
}

/// Where the sheet adheres: none where that is everywhere.
/// @throws InputError where that is nowhere
std::vector<Polygon> adhesive_area(const Parameters& p, stage::StageContext& context, const Region& sheet) {
  if (!context.has_input("adhesive")) return {};
  const Path file = context.input("adhesive");
  const std::vector<Polygon> rings = read_rings(file, p.pixel_size_um).points_um;
  const Polygon& outline = sheet.rims.front().points_um();
  const auto any_in = [](const Polygon& points, const Polygon& area) {
    return std::ranges::any_of(points, [&](Vec2 point) { return contains(area, point); });
  };
  if (!any_in(rings.front(), outline) && !any_in(outline, rings.front()))
    throw InputError(file.string(), "an area beneath the sheet, where it adheres", "one beside it",
                     "are outline and adhesive area of one image and in one unit?");
  return rings;
}

/// The triangles end at the border of the adhesive area where it lies inside of the sheet.
Region with_borders_of(Region region, const std::vector<Polygon>& adhesive_um) {
  constexpr double kClear_um = 0.1;  // nearer to the rim a border would ask for slivers
  const Polygon& rim = region.rims.front().points_um();
  for (const Polygon& border : adhesive_um)
    if (std::ranges::all_of(border,
                            [&](Vec2 p) { return contains(rim, p) && distance_to_boundary_um(rim, p) > kClear_um; }))
      region.lines.emplace_back(border);
  return region;
}

CellLabels read_labels(const Path& file, const std::optional<double>& pixel_um) {
  if (!pixel_um) throw UsageError("pixel_size_um is missing: " + file.string() + " counts in pixels");
  constexpr int kWidestLine_px = 15;
  const cells::LabelMask mask = cells::with_parts_labelled(cells::read_mask(file));
  return with_lines_filled({mask.width, mask.height, *pixel_um, mask.labels}, kWidestLine_px);
}

/// Contraction by cell of the label image; of what has no label, the sheet's own.
/// @throws UsageError where a cell is in no row and the sheet has no contraction
std::function<double(Vec2)> contraction_by_cell(const Parameters& p, stage::StageContext& context) {
  if (!context.has_input("cells")) throw UsageError("--contractions needs the label image --cells");
  const Path file = context.input("contractions");
  const files::CsvTable table(file);
  table.require({"cell", "contraction_nN_per_um"});
  std::map<int, double> by_cell;
  for (int row = 0; row < table.n_rows(); ++row)
    by_cell[table.integer(row, "cell", 1)] = table.number(row, "contraction_nN_per_um", Range::between(0, 1e4));
  const bool has_rest = p.sheet.contraction_nN_per_um || p.sheet.contraction_kPa;
  const double rest = has_rest ? contraction_of(p.sheet) : 0;
  const auto cells = std::make_shared<const CellLabels>(read_labels(context.input("cells"), p.pixel_size_um));
  for (const int label : cells->labels)
    if (label != 0 && !by_cell.contains(label) && !has_rest)
      throw InputError(file.string(), "a row for each cell of the label image", "none of cell " + std::to_string(label),
                       "add it, or give contraction_nN_per_um");
  return [=](Vec2 place) {
    const auto found = by_cell.find(cells->at_um(place));
    return found == by_cell.end() ? rest : found->second;
  };
}

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

// --- outputs

/// sheet.csv, traction.csv, sheet.vtu. @returns points that lie outside
std::size_t write_solution(stage::StageContext& context, const Solution& solution) {
  const std::vector<SheetPoint> rows = context.has_input("points")
                                           ? at_points_of(solution, files::read_points(context.input("points")))
                                           : at_nodes_of(solution);
  write_sheet(context.output("out", "sheet.csv"), rows);
  tractions::write_tractions(context.output("out", "traction.csv"), solution.patches);
  write_sheet_vtu(context.output("out", "sheet.vtu"), solution);
  files::write_text(context.output("out", "sheet.svg"), picture_of(solution, "mbtfm-sheet; x to the right, y down"));
  return static_cast<std::size_t>(std::ranges::count_if(rows, [](const SheetPoint& row) { return !row.ux_um; }));
}

/// borders.csv and cell_tension.csv. @returns means over all borders, by their length
Figures write_cells(stage::StageContext& context, const Solution& solution, const std::optional<double>& pixel_um) {
  if (!context.has_input("cells")) return {};
  constexpr double kShortest_um = 2;
  const CellLabels labels = read_labels(context.input("cells"), pixel_um);
  const std::vector<Border> borders = borders_of(labels, solution, kShortest_um);
  write_borders(context.output("out", "borders.csv"), borders);
  write_cell_tensions(context.output("out", "cell_tension.csv"), cell_tensions(labels, solution));
  double length = 0, normal = 0, shear = 0, magnitude = 0;
  for (const Border& b : borders) {
    length += b.length_um;
    normal += b.length_um * b.normal_nN_per_um;
    shear += b.length_um * b.shear_nN_per_um;
    magnitude += b.length_um * b.magnitude_nN_per_um;
  }
  if (length == 0) return {};
  return {{"n_borders", static_cast<std::int64_t>(borders.size())},
          {"border_normal_nN_per_um", normal / length},
          {"border_shear_nN_per_um", shear / length},
          {"border_magnitude_nN_per_um", magnitude / length}};
}

Figures figures_of(const Solution& solution, const Balance& balance) {
  double largest_um = 0;
  for (int i = 0; i < solution.elements->n_nodes(); ++i)
    largest_um = std::max(largest_um, norm(at_node(solution.u, i)));
  double largest_kPa = 0;
  for (const GroundPatch& patch : solution.patches) largest_kPa = std::max(largest_kPa, norm(patch.traction_kPa));
  Figures figures = {{"n_triangles", std::int64_t{solution.elements->n_triangles()}},
                     {"n_nodes", std::int64_t{solution.elements->n_nodes()}},
                     {"area_um2", balance.area_um2},
                     {"mean_tension_nN_per_um", balance.mean_tension_nN_per_um},
                     {"virial_tension_nN_per_um", balance.virial_tension_nN_per_um},
                     {"largest_displacement_um", largest_um},
                     {"largest_traction_kPa", largest_kPa},
                     {"total_force_nN", balance.total_force_nN},
                     {"net_force_nN", norm(balance.net_force_nN)},
                     {"net_torque_nN_um", balance.net_torque_nN_um},
                     {"energy_fJ", balance.elastic_energy_fJ},
                     {"mesh_relative_error", relative_error(*solution.elements, solution.at_points, solution.at_nodes)},
                     {"iterations", std::int64_t{solution.report.iterations}}};
  if (solution.gel_held) figures.emplace_back("strain_energy_fJ", balance.ground_energy_fJ);
  return figures;
}

void append(Figures& to, const Figures& more) { to.insert(to.end(), more.begin(), more.end()); }

/// What is said of every sheet.
void notice_mesh(stage::StageContext& context, const Solution& solution) {
  const double error = relative_error(*solution.elements, solution.at_points, solution.at_nodes);
  context.notice(noticed(Symptom::sheet_coarse, error));
}

/// displacement.csv: what the patches' forces make of the gel's surface.
/// @param points_um  of the file  @param taken_um  where these lie on the gel that is computed
void write_beads(stage::StageContext& context, const substrate::Substrate& model, const Solution& solution,
                 const std::vector<Vec2>& points_um, const std::vector<Vec2>& taken_um) {
  const std::vector<Vec2> u = displacements_um(model, solution, taken_um);
  DisplacementField field;
  for (std::size_t i = 0; i < points_um.size(); ++i)
    field.push_back({.position_um = points_um[i], .displacement_um = u[i], .sigma_um = 0, .flag = {}});
  files::write_displacement(context.output("out", "displacement.csv"), field);
}

// --- the sheet under its own contraction

Effect thickness_effect(const Material& material, const Region& region) {
  const double ratio = material.thickness_um / narrow_um(region);
  Effect effect =
      stage::decided(EffectKind::third_dimension, Switch::off, ratio, kThinnest, "thickness over half width");
  return effect;
}

void notice_shape(stage::StageContext& context, const Material& material, const Region& region) {
  context.notice(noticed(Symptom::sheet_thick, material.thickness_um / narrow_um(region)));
}

/// Of the gel; how large the strains are is the sheet's own question.
std::vector<Effect> effects_of(const substrate::Substrate& gel) {
  std::vector<Effect> effects = gel.effects();
  std::erase_if(effects, [](const Effect& e) { return e.kind == EffectKind::large_strain; });
  return effects;
}

struct Run {
  Solution solution;
  Figures figures;
  std::vector<Effect> effects;
  std::optional<Balance> balance = {};       ///< with what holds the sheet at cuts; unset: by the solution alone
  std::string told = {};                     ///< for the last line
  std::string varied = {};                   ///< what a varying contraction changes
  std::vector<report::Listing> tables = {};  ///< of the page
};

/// Where it is by cell, nN_per_um is the largest.
Contraction contraction_asked(const Parameters& p, stage::StageContext& context) {
  if (!context.has_input("contractions")) return {contraction_of(p.sheet), p.sheet.edge_band_um, {}};
  Contraction contraction{0, p.sheet.edge_band_um, contraction_by_cell(p, context)};
  const files::CsvTable table(context.input("contractions"));
  for (int row = 0; row < table.n_rows(); ++row)
    contraction.nN_per_um = std::max(contraction.nN_per_um, table.number(row, "contraction_nN_per_um"));
  return contraction;
}

Run run_forward(const Parameters& p, stage::StageContext& context, const Region& region) {
  Scene scene;
  scene.adhesive_um = adhesive_area(p, context, region);
  scene.region = with_borders_of(region, scene.adhesive_um);
  scene.material = material_of(p.sheet);
  scene.contraction = contraction_asked(p, context);
  scene.line_tension_nN = p.sheet.line_tension_nN;
  scene.adhesion_nN_per_um3 = p.sheet.adhesion_stiffness_nN_per_um3;
  scene.measure = p.sheet.contraction_measure;
  const double x = free_contraction(scene.material, scene.contraction.nN_per_um);
  if (x > kMostContraction)
    throw UsageError(
        "[sheet] contraction: a sheet that nothing holds would contract by " + brief(x) + ", more than the " +
        brief(kMostContraction) +
        " up to which a sheet is known to be stable; check contraction, youngs_modulus_kPa and thickness_um");
  std::optional<Gel> gel;
  if (p.gel_modulus_kPa) {
    gel = p.gel;
    gel->youngs_modulus_kPa = *p.gel_modulus_kPa;
    check(*gel);
  }
  const auto [ground, response] = decide_ground(p.sheet.ground, scene.material, scene.adhesion_nN_per_um3, gel);
  // the edge's tension is known for small strains alone: the finding large-strain then says what that costs
  const bool has_line = scene.line_tension_nN > 0;
  const auto asked_strain = !p.sheet.strain && has_line ? std::optional(Strain::small) : p.sheet.strain;
  const Effect strain = decide_strain(asked_strain, x, ground);
  scene.strain = strain.is_on ? Strain::large : Strain::small;
  Run result;
  const double M = scene.material.stiffness_nN_per_um();
  result.figures = {{"ground", std::string(name_of(ground))},
                    {"strain", std::string(name_of(scene.strain))},
                    {"stiffness_nN_per_um", M},
                    {"contraction_nN_per_um", scene.contraction.nN_per_um},
                    {"free_contraction", x}};
  if (ground == Ground::springs && context.has_input("beads"))
    throw UsageError("--beads are moved by a gel: the sheet stands on springs (" + response.why + ")");
  if (ground == Ground::springs) {
    const double l_um = std::sqrt(M / *scene.adhesion_nN_per_um3);
    scene.size = size_on_springs(region, l_um);
    result.figures.emplace_back("penetration_um", l_um);
    context.assumed.clear();  // of a gel
  }
  std::unique_ptr<substrate::Substrate> model;
  if (ground == Ground::gel) {
    model = choice::make_substrate(*gel, p.substrate, context.threads);
    scene.size =
        size_on_gel(region, scene.material, *gel, scene.adhesion_nN_per_um3, model->capabilities(), scene.strain);
  }
  if (p.sheet.mesh_um) scene.size = with_edge(scene.size, *p.sheet.mesh_um);
  context.progress(0.1, "solving for the sheet");
  if (ground == Ground::springs) {
    result.solution = solve_on_springs(scene, context.threads);
  } else {
    result.solution = solve_on_gel(scene, *model, context.threads);
    if (context.has_input("beads")) {
      const std::vector<Vec2> points = files::read_points(context.input("beads"));
      write_beads(context, *model, result.solution, points, points);
    }
    append(result.figures, model->figures());
    result.figures.emplace_back("gel_compliance", std::string(name_of(*result.solution.gel_held)));
    result.effects = effects_of(*model);
  }
  const bool slips = ground == Ground::gel && scene.adhesion_nN_per_um3.has_value();
  const double line = scene.line_tension_nN / (narrow_um(region) * std::max(scene.contraction.nN_per_um, 1e-300));
  result.effects.insert(
      result.effects.end(),
      {response, strain,
       stage::decided(EffectKind::adhesion_slip, switched(slips), slips,
                      slips ? "adhesion_stiffness_nN_per_um3 is given" : "no springs between sheet and gel"),
       stage::decided(EffectKind::edge_tension, switched(scene.line_tension_nN > 0), scene.line_tension_nN > 0,
                      "its pull is " + brief(line) + " of the contraction's"),
       thickness_effect(scene.material, region)});
  notice_shape(context, scene.material, region);
  if (scene.strain == Strain::small) context.notice(noticed(Symptom::contraction_beyond_linear, x));
  return result;
}

// --- the sheet under given tractions

/// Where the sheet ends.
Region area_around(const Region& region, stage::StageContext& context, const Parameters& p) {
  if (context.has_input("area")) return region_of(read_rings(context.input("area"), p.pixel_size_um));
  return region;
}

/// What the edge along the cuts makes of the tensions: with that held, clamped or free.
Figures tell_cut(stage::StageContext& context, const Region& area, const Polygon& outline, const Solution& held,
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
    append(result.figures, tell_cut(context, area, outline, result.solution, *found.cut, with));
  }
  const double mean = found.balance.mean_tension_nN_per_um;
  context.notice(noticed(Symptom::sheet_expands, mean < 0 ? 1 : 0, {.at = "mean tension " + brief(mean) + " nN/µm"}));
  const double worst = std::max(found.unbalanced.net_force_share, found.unbalanced.net_torque_share);
  context.notice(noticed(Symptom::tractions_off_balance, worst));
  context.notice(noticed(Symptom::tractions_outside, found.unbalanced.outside_share));
  return result;
}

// --- the sheet under the beads' displacements

/// Beads without flags, and with an error each where any neighbours tell it.
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

using sheets::Part;

std::vector<Part> parts_of_cells(const Parameters& p, stage::StageContext& context) {
  if (!context.has_input("cells")) throw UsageError("fit_parts = cells needs --cells");
  const auto cells = std::make_shared<const CellLabels>(read_labels(context.input("cells"), p.pixel_size_um));
  std::set<int> labels(cells->labels.begin(), cells->labels.end());
  labels.erase(0);
  constexpr std::size_t kMost = 30;  // a solution for each at each of 20 stiffnesses
  if (labels.size() > kMost)
    throw InputError(context.input("cells").string(), "at most 30 cells with contractions of their own",
                     std::to_string(labels.size()), "join cells, or take fit_parts = edge");
  std::vector<Part> parts;
  for (const int label : labels)
    parts.push_back(
        {"cell " + std::to_string(label), [=](Vec2 place) { return cells->at_um(place) == label ? 1.0 : 0.0; }});
  parts.push_back({"no cell", [=](Vec2 place) { return cells->at_um(place) == 0 ? 1.0 : 0.0; }});
  return parts;
}

std::vector<Part> parts_of(const Parameters& p, stage::StageContext& context, const Region& region) {
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
std::string told_by(const sheets::SheetFit& fit) {
  std::string told;
  std::vector<double> bundles_nN;
  for (const SheetEstimate& e : fit.estimates)
    if (e.quantity == sheets::Quantity::bundle_tension)
      bundles_nN.push_back(e.value);
    else
      told += (told.empty() ? "" : "; ") + sentence_of(e);
  if (bundles_nN.empty()) return told;
  const auto [least, most] = std::ranges::minmax(bundles_nN);  // sheet_fit.csv has each
  return told +
         (bundles_nN.size() == 1 ? "; tension of a bundle " + brief(least)
                                 : "; tensions of " + counted(std::ssize(bundles_nN), "bundles") + " " + brief(least) +
                                       " to " + brief(most)) +
         " nN";
}

/// What a reader must know of the fit.
void notice_fit(stage::StageContext& context, const sheets::BeadFit& found, const std::string& told) {
  const sheets::SheetFit& fit = found.fit;
  const auto stiffness = std::ranges::find(fit.estimates, sheets::Quantity::stiffness, &SheetEstimate::quantity);
  context.notice(noticed(Symptom::sheet_not_identifiable, stiffness->identifiable ? 0 : 1, {.at = told}));
  notice_unexplained(context, fit, found.misfit);
  if (!found.field) notice_expansion(context, fit, found.n_parts);
  context.notice(
      noticed(Symptom::sheet_at_bound, fit.is_at_bound ? 1 : 0, {.value = brief(fit.stiffnesses.sheet_nN_per_um)}));
}

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
  result.told = told_by(fit);
  result.tables = report::tables_of_sheet(estimates_file, models_file);
  result.varied = found.varied;
  notice_fit(context, found, result.told);
  result.figures = {{"ground", std::string(name_of(Ground::gel))},
                    {"strain", std::string(name_of(Strain::small))},
                    {"stiffness_nN_per_um", fit.stiffnesses.sheet_nN_per_um},
                    {"contraction_nN_per_um", scene.contraction.nN_per_um},
                    {"youngs_modulus_kPa", scene.material.youngs_modulus_kPa},
                    {"fitted", result.told},
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
  result.effects.push_back(thickness_effect(scene.material, region));
  notice_shape(context, scene.material, region);
  context.notice(noticed(Symptom::contraction_beyond_linear, x));
  return result;
}

/// sheet.html
void write_page(stage::StageContext& context, const Run& done, const Balance& balance) {
  report::StagePage page{
      .title = "Contracting sheet", .facts = {}, .findings = context.findings_, .tables = {}, .figures = done.figures};
  constexpr double kRounding = 1e-6;
  if (!done.told.empty()) page.facts.push_back("Fitted to the beads: " + done.told + ".");
  if (!done.varied.empty()) page.facts.push_back(done.varied);
  page.facts.push_back("The mean tension is " + charts::readable(balance.mean_tension_nN_per_um) + " nN/µm over " +
                       charts::readable(balance.area_um2) + " µm²; the forces on the ground add up to " +
                       charts::readable(balance.total_force_nN) + " nN in size, " +
                       (norm(balance.net_force_nN) > kRounding * balance.total_force_nN
                            ? "and to a net force of " + charts::readable(norm(balance.net_force_nN)) + " nN."
                            : std::string("and balance each other.")));
  page.picture_svg = picture_of(done.solution, "x to the right, y down");
  page.picture_title = "Tension and traction";
  page.picture_explained =
      "Left: mean principal tension. Right: traction on the ground; arrows are means over squares.";
  page.tables = done.tables;
  files::write_text(context.output("out", "sheet.html"), report::html_of(page));
}

StageReport run(const Parameters& p, stage::StageContext& context) {
  context.progress(0, "reading");
  const Path outline = context.input("outline");
  const Region region = region_of(read_rings(outline, p.pixel_size_um));
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
  append(done.figures, figures_of(done.solution, balance));
  append(done.figures, write_cells(context, done.solution, p.pixel_size_um));
  files::write_figures(context.output("out", "sheet.json"), done.figures);
  notice_mesh(context, done.solution);
  write_page(context, done, balance);
  context.progress(1, "done");

  StageReport report;
  report.converged = done.solution.report.converged;
  report.summary = std::to_string(done.solution.elements->n_triangles()) + " triangles, mean tension " +
                   brief(balance.mean_tension_nN_per_um) + " nN/µm over " + brief(balance.area_um2) +
                   " µm², total force " + brief(balance.total_force_nN) + " nN; " + done.solution.report.reason;
  if (!done.told.empty()) report.summary += "; " + done.told;
  if (!region.cuts.empty() && !has_tractions)
    report.summary += "; WARNING: the image cuts the sheet, whose edge there counts as free";
  if (n_outside > 0) report.summary += "; " + counted(n_outside, "point lies", "points lie") + " outside of the sheet";
  report.figures = done.figures;
  report.effects = done.effects;
  return report;
}

}  // namespace
}  // namespace mbtfm::sheet

int main(int argc, char** argv) {
  using Kind = mbtfm::stage::FileArgument::Kind;
  using namespace mbtfm::sheet;
  return mbtfm::stage::run_stage<Parameters>(
      {.name = "sheet",
       .purpose = "contract a sheet of cells, or find a colony's tensions from tractions or beads",
       .files = {{"outline", Kind::input,
                  "outline of the sheet: outline.csv, a mask (PNG, TIFF) or an ImageJ selection (.roi, .zip)"},
                 {"traction", Kind::optional_input,
                  "traction.csv under the sheet (x_um, y_um, tx_kPa, ty_kPa; area_um2 unless on a lattice)"},
                 {"displacement", Kind::optional_input,
                  "displacement.csv of the beads, to fit contraction and stiffness"},
                 {"adhesions", Kind::optional_input,
                  "with --displacement: adhesions.csv, a model to compare in sheet_models.csv"},
                 {"bundles", Kind::optional_input,
                  "with --displacement: fibre_points.csv of stress fibres whose tensions are fitted, too"},
                 {"beads", Kind::optional_input, "on a gel: surface points x_um, y_um for displacement.csv"},
                 {"cells", Kind::optional_input,
                  "label image of the cells: writes borders.csv (forces between them) and cell_tension.csv"},
                 {"contractions", Kind::optional_input,
                  "with --cells: contraction of each (cell, contraction_nN_per_um); others have that of [sheet]"},
                 {"adhesive", Kind::optional_input, "where the sheet adheres, as the outline; unset: everywhere"},
                 {"area", Kind::optional_input,
                  "with --traction: area around the outline in which the sheet ends; unset: the outline"},
                 {"points", Kind::optional_input, "points of sheet.csv: x_um, y_um; unset: the nodes"},
                 {"out", Kind::output_folder,
                  "folder of sheet.csv, traction.csv, sheet.vtu, sheet.svg, sheet.html, sheet.json; of a fit also "
                  "sheet_fit.csv, sheet_models.csv, displacement.csv"}}},
      argc, argv, run);
}
