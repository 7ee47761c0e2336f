#include <algorithm>
#include <map>
#include <memory>

#include "continuum/sheet/mesh_size.h"
#include "mbtfm/sheet_stage/runs.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/tables.h"
#include "pipeline/stage/effects.h"

namespace mbtfm::sheet_stage {

void write_beads(stage::StageContext& context, const substrate::Substrate& model, const Solution& solution,
                 const std::vector<Vec2>& points_um, const std::vector<Vec2>& taken_um) {
  const std::vector<Vec2> u = displacements_um(model, solution, taken_um);
  DisplacementField field;
  for (std::size_t i = 0; i < points_um.size(); ++i)
    field.push_back({.position_um = points_um[i], .displacement_um = u[i], .sigma_um = 0, .flag = {}});
  files::write_displacement(context.output("out", "displacement.csv"), field);
}

Effect third_dimension(stage::StageContext& context, const Material& material, const Region& region) {
  const double ratio = material.thickness_um / narrow_um(region);
  context.notice(noticed(Symptom::sheet_thick, ratio));
  return stage::decided(EffectKind::third_dimension, Switch::off, ratio, kThinnest, "thickness over half width");
}

std::vector<Effect> effects_of(const substrate::Substrate& gel) {
  std::vector<Effect> effects = gel.effects();
  std::erase_if(effects, [](const Effect& e) { return e.kind == EffectKind::large_strain; });
  return effects;
}

namespace {

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

/// Where it is by cell, nN_per_um is the largest.
Contraction contraction_asked(const Parameters& p, stage::StageContext& context) {
  if (!context.has_input("contractions")) return {contraction_of(p.sheet), p.sheet.edge_band_um, {}};
  Contraction contraction{0, p.sheet.edge_band_um, contraction_by_cell(p, context)};
  const files::CsvTable table(context.input("contractions"));
  for (int row = 0; row < table.n_rows(); ++row)
    contraction.nN_per_um = std::max(contraction.nN_per_um, table.number(row, "contraction_nN_per_um"));
  return contraction;
}

}  // namespace

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
    std::ranges::copy(model->figures(), std::back_inserter(result.figures));
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
       third_dimension(context, scene.material, region)});
  if (scene.strain == Strain::small) context.notice(noticed(Symptom::contraction_beyond_linear, x));
  return result;
}

}  // namespace mbtfm::sheet_stage
