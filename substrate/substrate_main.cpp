#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <string>

#include "pipeline/contract/results.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/text.h"
#include "pipeline/stage/stage.h"
#include "substrate/choice/decide.h"
#include "substrate/choice/factory.h"
#include "substrate/gel_vtu.h"
#include "substrate/loads.h"
#include "substrate/response.h"

namespace mbtfm {
namespace {

struct Parameters {
  Gel gel;
  substrate::SubstrateParameters substrate;
};

void declare(stage::ParameterList& list, Parameters& p) {
  declare(list, p.gel);
  declare(list, p.substrate);
  list.add(
      "material", p.substrate.material,
      "law of the gel: linear (small strains), or neo-hooke, where the tractions call for large ones (model curved)");
  declare(list, p.substrate.effects,
          {"finite_thickness", "finite_sides", "depth_graded_gel", "vertical_displacement", "large_strain",
           "effect_tolerance"});
}

struct Load {
  std::vector<substrate::Ellipse> ellipses;
  std::vector<Vec2> forces_nN;
  std::vector<double> into_the_gel_nN;  ///< by ellipse; empty: all lie along the surface
};

Load read_forces(const Path& adhesions_file, const Path& file) {
  std::map<int, substrate::Ellipse> ellipse_of_id;
  for (const Adhesion& adhesion : files::read_adhesions(adhesions_file)) {
    ellipse_of_id[adhesion.adhesion_id] = substrate::ellipse_of(adhesion);
  }
  Load load;
  const files::CsvTable table(file);
  if (table.has("fz_nN")) {
    for (int row = 0; row < table.n_rows(); ++row) load.into_the_gel_nN.push_back(table.number(row, "fz_nN"));
  }
  for (const AdhesionForce& force : files::read_adhesion_forces(file)) {
    const auto found = ellipse_of_id.find(force.adhesion_id);
    if (found == ellipse_of_id.end()) {
      throw InputError(file.string(), "the adhesion_id of a row of " + adhesions_file.string(),
                       "'" + std::to_string(force.adhesion_id) + "'",
                       "both files must come from the same segmentation");
    }
    load.ellipses.push_back(found->second);
    load.forces_nN.push_back(force.force_nN);
  }
  return load;
}

/// Steps of a lattice: the smallest distance between its columns and between its rows.
Vec2 spacing_of(const std::vector<Vec2>& points, const Path& file) {
  const auto step = [&](double Vec2::*axis) {
    std::vector<double> values;
    for (const Vec2& p : points) values.push_back(p.*axis);
    std::sort(values.begin(), values.end());
    double smallest = 0;
    for (std::size_t k = 1; k < values.size(); ++k) {
      const double gap = values[k] - values[k - 1];
      // columns of a lattice, written with some digits
      if (gap > 1e-6 * (values.back() - values.front()) && (smallest == 0 || gap < smallest)) smallest = gap;
    }
    return smallest;
  };
  const Vec2 spacing = {step(&Vec2::x), step(&Vec2::y)};
  if (spacing.x > 0 && spacing.y > 0) return spacing;
  throw InputError(file.string(), "tractions on a lattice of at least two columns and rows, or a column area_um2",
                   std::to_string(points.size()) + " rows");
}

/// Each patch as a disc of its area: the same force; the second moment is 5 % off, a side away 0.4 % of its field.
Load read_tractions(const Path& file) {
  const files::CsvTable table(file);
  const std::vector<Vec2> points = files::read_points(file);
  const bool has_areas = table.has("area_um2"), is_in_space = table.has("tz_kPa");
  const Vec2 spacing = has_areas ? Vec2{} : spacing_of(points, file);
  Load load;
  for (int row = 0; row < table.n_rows(); ++row) {
    const double area = has_areas ? table.number(row, "area_um2", Range::positive()) : spacing.x * spacing.y;
    const Vec2 traction = {table.number(row, "tx_kPa"), table.number(row, "ty_kPa")};
    const double into_the_gel = is_in_space ? table.number(row, "tz_kPa") : 0;
    if (traction.x == 0 && traction.y == 0 && into_the_gel == 0) continue;
    if (is_in_space) load.into_the_gel_nN.push_back(area * into_the_gel);
    const double radius = std::sqrt(area / std::numbers::pi);
    load.ellipses.push_back({points[row], radius, radius, 0});
    load.forces_nN.push_back(area * traction);
  }
  return load;
}

Load read_load(stage::StageContext& context) {
  const bool has_forces = context.has_input("forces") && context.has_input("adhesions");
  const bool has_tractions = context.has_input("traction");
  if (has_forces == has_tractions) {
    throw UsageError("expected either --adhesions and --forces, or --traction");
  }
  if (has_tractions) return read_tractions(context.input("traction"));
  return read_forces(context.input("adhesions"), context.input("forces"));
}

/// Points below the surface, or forces into the gel.
bool is_in_space(stage::StageContext& context, const Load& load) {
  return !load.into_the_gel_nN.empty() ||
         (context.has_input("points") && files::CsvTable(context.input("points")).has("z_um"));
}

/// displacement_3d.csv at points of the gel's inside, or by forces into it.
void write_in_space(stage::StageContext& context, const substrate::Substrate& model, const Load& load,
                    Figures& figures) {
  const Path file = context.input("points");
  const files::CsvTable table(file);
  const bool has_depth = table.has("z_um");
  std::vector<Vec3> points;
  for (const Vec2 p : files::read_points(file)) {
    const int row = static_cast<int>(points.size());
    points.push_back({p.x, p.y, has_depth ? table.number(row, "z_um", Range::not_negative()) : 0});
  }
  const auto n = static_cast<Eigen::Index>(load.ellipses.size());
  Eigen::VectorXd forces_nN = Eigen::VectorXd::Zero(3 * n);
  for (Eigen::Index j = 0; j < n; ++j) {
    const auto at = static_cast<std::size_t>(j);
    forces_nN.segment<2>(3 * j) << load.forces_nN[at].x, load.forces_nN[at].y;
    if (!load.into_the_gel_nN.empty()) forces_nN[3 * j + 2] = load.into_the_gel_nN[at];
  }
  const Eigen::VectorXd u =
      model.response({load.ellipses, 3}, {points, substrate::Components::all})->displace(forces_nN).col(0);
  files::CsvText csv({"x_um", "y_um", "z_um", "ux_um", "uy_um", "uz_um", "sigma_um", "sigma_z_um", "flag"});
  double largest_um = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d at_point = u.segment<3>(3 * static_cast<Eigen::Index>(i));
    csv.add(points[i].x).add(points[i].y).add(points[i].z);
    for (const double component : at_point) csv.add(component);
    csv.add(0.0).add(0.0).add("");
    csv.end_row();
    largest_um = std::max(largest_um, at_point.norm());
  }
  files::write_text(context.output("out"), csv.str());
  figures.emplace_back("n_points", static_cast<std::int64_t>(points.size()));
  figures.emplace_back("largest_displacement_um", largest_um);
}

/// displacement.csv at the points; uz_um after its columns where the model has it.
void write_at_points(stage::StageContext& context, const substrate::Substrate& model, const Load& load,
                     Figures& figures) {
  const std::vector<Vec2> points = files::read_points(context.input("points"));
  const std::vector<Vec2> displacements = model.displacements_um(points, load.ellipses, load.forces_nN);
  double largest_um = 0;
  DisplacementField field;
  for (std::size_t i = 0; i < points.size(); ++i) {
    field.push_back({.position_um = points[i], .displacement_um = displacements[i], .sigma_um = 0, .flag = {}});
    largest_um = std::max(largest_um, norm(displacements[i]));
  }
  figures.emplace_back("n_points", static_cast<std::int64_t>(points.size()));
  figures.emplace_back("largest_displacement_um", largest_um);
  if (!model.has_vertical()) return files::write_displacement(context.output("out"), field);
  const std::vector<double> vertical = model.vertical_um(points, load.ellipses, load.forces_nN);
  files::CsvText csv({"x_um", "y_um", "ux_um", "uy_um", "sigma_um", "uz_um"});
  for (std::size_t i = 0; i < points.size(); ++i) {
    csv.add(points[i].x).add(points[i].y).add(displacements[i].x).add(displacements[i].y).add(0.0).add(vertical[i]);
    csv.end_row();
  }
  files::write_text(context.output("out"), csv.str());
}

void write_result(stage::StageContext& context, const substrate::Substrate& model, const Load& load, Figures& figures) {
  const bool in_space = is_in_space(context, load);
  if (context.has_input("points")) return (in_space ? write_in_space : write_at_points)(context, model, load, figures);
  if (in_space) throw UsageError("expected --points where forces point into the gel: pictures show those along it");
  const Path file = context.output("out");
  if (context.outputs_.at("out").extension() != ".vtu") {
    throw UsageError("expected --points, or an --out that ends with .vtu or volume.vtu");
  }
  if (context.outputs_.at("out").stem().string().ends_with("volume")) {
    substrate::write_volume_vtu(file, model.volume(load.ellipses, load.forces_nN));
  } else {
    substrate::write_substrate_vtu(file, model, load.ellipses, load.forces_nN);
  }
}

/// Along the surface and into the gel, over each patch.
double largest_traction_kPa(const Load& load) {
  double largest = 0;
  for (std::size_t j = 0; j < load.ellipses.size(); ++j) {
    const double into = load.into_the_gel_nN.empty() ? 0 : load.into_the_gel_nN[j];
    const double area = std::numbers::pi * load.ellipses[j].semi_major_um * load.ellipses[j].semi_minor_um;
    largest = std::max(largest, std::hypot(norm(load.forces_nN[j]), into) / area);
  }
  return largest;
}

StageReport run(const Parameters& given, stage::StageContext& context) {
  Parameters parameters = given;
  Switch& vertical = parameters.substrate.effects.vertical_displacement;
  const Load load = read_load(context);
  if (vertical == Switch::automatic && (!context.has_input("points") || is_in_space(context, load)))
    vertical = Switch::on;  // what is written has three components
  const Effect strain = choice::decide_large_strain(parameters.gel, parameters.substrate, largest_traction_kPa(load));
  parameters.substrate.effects.large_strain = strain.is_on ? Switch::on : Switch::off;
  const auto model = choice::make_substrate(parameters.gel, parameters.substrate, context.threads);
  context.progress(0.1, "solving for the substrate");
  StageReport report;
  write_result(context, *model, load, report.figures);
  report.summary =
      std::to_string(load.ellipses.size()) + " loaded patches, model " + name_of(parameters.substrate.model);
  report.figures.emplace_back("n_loads", static_cast<std::int64_t>(load.ellipses.size()));
  for (const auto& figure : model->figures()) report.figures.push_back(figure);
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
  return stage::run_stage<Parameters>(
      {.name = "substrate",
       .purpose = "displace a gel by forces spread over adhesions, or by tractions",
       .files = {{"adhesions", Kind::optional_input, "adhesions.csv: the ellipses"},
                 {"forces", Kind::optional_input, "adhesion_forces.csv: adhesion_id, fx_nN, fy_nN; fz_nN into the gel"},
                 {"traction", Kind::optional_input,
                  "instead of those: tractions on a lattice: x_um, y_um, tx_kPa, ty_kPa; tz_kPa into the "
                  "gel; area_um2 where it is none"},
                 {"points", Kind::optional_input, "points: x_um, y_um; z_um below the surface"},
                 {"out", Kind::output,
                  "displacement.csv at the points, with z_um or forces into the gel displacement_3d.csv; without "
                  "points a .vtu of the surface, or of the gel's inside where "
                  "its name ends with volume.vtu"}}},
      argc, argv, run);
}
