/// mbtfm-substrate: a gel under forces on adhesions, or under tractions.
#include <algorithm>
#include <memory>

#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"
#include "substrate/choice/decide.h"
#include "substrate/choice/factory.h"
#include "substrate/choice/large_strain.h"
#include "substrate/given_load.h"
#include "substrate/surface/height.h"

namespace mbtfm {
namespace {

struct Parameters {
  Gel gel;
  substrate::SubstrateParameters substrate;
};

void declare(stage::ParameterList& list, Parameters& p) {
  declare(list, p.gel);
  declare(list, p.substrate);
  declare(list, p.substrate.effects,
          {"finite_thickness", "finite_sides", "depth_graded_gel", "vertical_displacement", "large_strain",
           "effect_tolerance"});
}

substrate::Load read_load(stage::StageContext& context, const Gel& gel) {
  const bool has_forces = context.has_input("forces") && context.has_input("adhesions");
  const bool has_tractions = context.has_input("traction");
  if (has_forces == has_tractions) {
    throw UsageError("expected either --adhesions and --forces, or --traction");
  }
  if (has_tractions) {
    const Path file = context.input("traction");
    if (!gel.surface || files::CsvTable(file).has("area_um2")) return substrate::read_tractions(file);
    substrate::Load load;
    load.lattice = substrate::read_surface_tractions(file);
    return load;
  }
  return substrate::read_forces(context.input("adhesions"), context.input("forces"));
}

/// A surface that is not flat, points below it, or forces into the gel.
bool is_in_space(stage::StageContext& context, const substrate::Load& load, const Gel& gel) {
  return gel.surface || !load.into_the_gel_nN.empty() ||
         (context.has_input("points") && files::CsvTable(context.input("points")).has("z_um"));
}

/// Where the gel's surface is, and how far it is known.
std::optional<substrate::SurfaceShape> shape_of(const Gel& gel) {
  if (!gel.surface) return std::nullopt;
  const surface::Height height(*gel.surface);
  return substrate::SurfaceShape{height, {height.low_um(), height.high_um()}};
}

void write_result(stage::StageContext& context, const substrate::Substrate& model, const substrate::Load& load,
                  const Gel& gel, Figures& figures) {
  if (context.has_input("points")) {
    const Path points = context.input("points"), file = context.output("out");
    figures = is_in_space(context, load, gel) ? substrate::write_in_space(file, points, model, load, shape_of(gel))
                                              : substrate::write_at_points(file, points, model, load);
    return;
  }
  if (!load.into_the_gel_nN.empty())
    throw UsageError("expected --points if forces point into the gel: pictures show those along it");
  const Path file = context.output("out"), name = context.outputs_.at("out");
  if (name.extension() != ".vtu") throw UsageError("expected --points, or an --out that ends with .vtu or volume.vtu");
  const bool is_volume = name.stem().string().ends_with("volume");
  if (is_volume && load.lattice)
    throw UsageError("expected --points or an --out of the surface: volumes are computed of forces on adhesions");
  if (is_volume)
    substrate::write_volume_vtu(file, model.volume(load.ellipses, load.forces_nN));
  else if (load.lattice)
    substrate::write_traction_vtu(file, model, load.lattice->mesh, load.lattice->traction_kPa, *shape_of(gel));
  else
    substrate::write_substrate_vtu(file, model, load.ellipses, load.forces_nN, substrate::kSurfaceLines, shape_of(gel));
}

StageReport run(const Parameters& given, stage::StageContext& context) {
  Parameters parameters = given;
  if (context.has_input("surface")) {
    parameters.gel.surface = std::make_shared<const HeightMap>(files::read_surface(context.input("surface")));
    check(parameters.gel);
    const auto [low, high] = std::ranges::minmax_element(parameters.gel.surface->z_um);
    context.notice(noticed(Symptom::surface_off_zero, std::max({0.0, *low, -*high}) / parameters.gel.thickness_um));
  }
  Switch& vertical = parameters.substrate.effects.vertical_displacement;
  const substrate::Load load = read_load(context, parameters.gel);
  if (vertical == Switch::automatic && (!context.has_input("points") || is_in_space(context, load, parameters.gel)))
    vertical = Switch::on;  // what is written has three components
  const double traction_kPa = load.lattice ? substrate::largest_traction_kPa(*load.lattice)
                                           : choice::mean_traction_kPa(load.ellipses, substrate::lengths_nN(load));
  const Effect strain =
      choice::decide_large_strain(parameters.substrate, choice::left_out_in_gel(parameters.gel, traction_kPa));
  parameters.substrate.effects.large_strain = strain.is_on ? Switch::on : Switch::off;
  const auto model = choice::make_substrate(parameters.gel, parameters.substrate, context.threads);
  context.progress(0.1, "solving for the substrate");
  StageReport report;
  write_result(context, *model, load, parameters.gel, report.figures);
  report.summary = std::to_string(load.size()) + " loaded patches, model " + name_of(parameters.substrate.model);
  report.figures.emplace_back("n_loads", static_cast<std::int64_t>(load.size()));
  std::ranges::copy(model->figures(), std::back_inserter(report.figures));
  report.effects = model->effects();
  for (Effect& e : report.effects) {
    if (e.kind == EffectKind::large_strain) {
      const double seconds = e.seconds;
      e = strain;
      e.seconds = seconds;
    }
    if (e.kind != EffectKind::vertical_displacement) continue;
    if (given.substrate.effects.vertical_displacement != Switch::automatic) continue;
    e.setting = Switch::automatic;
    if (e.is_on)
      e.why = context.has_input("points") ? "displacements in space are written" : "a surface in space is written";
  }
  return report;
}

}  // namespace
}  // namespace mbtfm

int main(int argc, char** argv) {
  using namespace mbtfm;
  using Kind = stage::FileArgument::Kind;
  return stage::run_stage<Parameters>({.name = "substrate",
                                       .files = {{"adhesions", Kind::optional_input},
                                                 {"forces", Kind::optional_input},
                                                 {"traction", Kind::optional_input},
                                                 {"surface", Kind::optional_input},
                                                 {"points", Kind::optional_input},
                                                 {"out", Kind::output}}},
                                      argc, argv, run);
}
