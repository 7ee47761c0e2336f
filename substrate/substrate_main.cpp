#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <memory>
#include <numbers>
#include <optional>
#include <string>

#include "pipeline/contract/kinds_of_effects.h"
#include "pipeline/contract/kinds_of_findings.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/contract/results.h"
#include "pipeline/files/csv.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/text.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/stage/parameters.h"
#include "pipeline/stage/stage.h"
#include "substrate/choice/decide.h"
#include "substrate/choice/factory.h"
#include "substrate/choice/large_strain.h"
#include "substrate/gel_vtu.h"
#include "substrate/loads.h"
#include "substrate/response.h"
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

/// Tractions of a lattice on a surface that is not flat: bilinear, as they are.
struct SurfaceLoad {
  substrate::SurfaceMesh mesh;
  VectorXd traction_kPa;  ///< three a vertex
};
struct Load {
  std::vector<substrate::Ellipse> ellipses;
  std::vector<Vec2> forces_nN;
  std::vector<double> into_the_gel_nN;  ///< by ellipse; empty: all lie along the surface
  std::optional<SurfaceLoad> lattice;   ///< instead of all these
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

SurfaceLoad read_surface_tractions(const Path& file) {
  const files::CsvTable table(file);
  const std::vector<Vec2> points = files::read_points(file);
  const Vec2 spacing = files::lattice_spacing_um(points, file);
  std::map<std::array<long long, 2>, int> vertex_at;
  const auto place = [&](Vec2 p) {
    return std::array{std::llround((p.x - points[0].x) / spacing.x), std::llround((p.y - points[0].y) / spacing.y)};
  };
  SurfaceLoad load{{points, {}}, VectorXd(3 * static_cast<Index>(points.size()))};
  for (int row = 0; row < table.n_rows(); ++row) {
    const Vec2 p = points[row];
    const auto at = place(p);
    if (!vertex_at.emplace(at, row).second) table.fail(row, "x_um", "each place of the lattice once");
    const Vec2 off =
        p - points[0] - Vec2{static_cast<double>(at[0]) * spacing.x, static_cast<double>(at[1]) * spacing.y};
    if (norm(off) > 0.01 * std::min(spacing.x, spacing.y)) table.fail(row, "x_um", "a place of an even lattice");
    load.traction_kPa.segment<3>(3 * row) << table.number(row, "tx_kPa"), table.number(row, "ty_kPa"),
        table.has("tz_kPa") ? table.number(row, "tz_kPa") : 0;
  }
  for (const auto& [at, vertex] : vertex_at) {
    std::array<int, 4> face{};
    constexpr std::array<std::array<int, 2>, 4> kRound = {{{0, 0}, {1, 0}, {1, 1}, {0, 1}}};
    bool is_whole = true;
    for (std::size_t k = 0; k < 4; ++k) {
      const auto corner = vertex_at.find({at[0] + kRound[k][0], at[1] + kRound[k][1]});
      is_whole = is_whole && corner != vertex_at.end();
      if (is_whole) face[k] = corner->second;
    }
    if (is_whole) load.mesh.faces.push_back(face);
  }
  if (load.mesh.faces.empty())
    throw InputError(file.string(), "tractions on a lattice", "no four of them around a square");
  return load;
}

/// Each patch as a disc of its area: the same force; the second moment is 5 % off, a side away 0.4 % of its field.
Load read_tractions(const Path& file) {
  const files::CsvTable table(file);
  const bool is_in_space = table.has("tz_kPa");
  Load load;
  int row = 0;
  for (const GroundPatch& patch : files::read_tractions(file)) {
    const double into_the_gel = is_in_space ? table.number(row, "tz_kPa") : 0;
    ++row;
    if (patch.traction_kPa == Vec2{} && into_the_gel == 0) continue;
    if (is_in_space) load.into_the_gel_nN.push_back(patch.area_um2 * into_the_gel);
    const double radius = std::sqrt(patch.area_um2 / std::numbers::pi);
    load.ellipses.push_back({patch.position_um, radius, radius, 0});
    load.forces_nN.push_back(patch.area_um2 * patch.traction_kPa);
  }
  return load;
}

Load read_load(stage::StageContext& context, const Gel& gel) {
  const bool has_forces = context.has_input("forces") && context.has_input("adhesions");
  const bool has_tractions = context.has_input("traction");
  if (has_forces == has_tractions) {
    throw UsageError("expected either --adhesions and --forces, or --traction");
  }
  if (has_tractions) {
    const Path file = context.input("traction");
    if (!gel.surface || files::CsvTable(file).has("area_um2")) return read_tractions(file);
    Load load;
    load.lattice = read_surface_tractions(file);
    return load;
  }
  return read_forces(context.input("adhesions"), context.input("forces"));
}

/// A surface that is not flat, points below it, or forces into the gel.
bool is_in_space(stage::StageContext& context, const Load& load, const Gel& gel) {
  return gel.surface || !load.into_the_gel_nN.empty() ||
         (context.has_input("points") && files::CsvTable(context.input("points")).has("z_um"));
}

struct UnitLoads {
  substrate::Loads loads;
  VectorXd amounts;  ///< nN of each ellipse, kPa at each vertex of a lattice
};
UnitLoads in_space(const Load& load) {
  if (load.lattice) return {{load.lattice->mesh, 3}, load.lattice->traction_kPa};
  VectorXd amounts = VectorXd::Zero(3 * static_cast<Index>(load.ellipses.size()));
  for (std::size_t j = 0; j < load.ellipses.size(); ++j) {
    const double into = load.into_the_gel_nN.empty() ? 0 : load.into_the_gel_nN[j];
    amounts.segment<3>(3 * static_cast<Index>(j)) << load.forces_nN[j].x, load.forces_nN[j].y, into;
  }
  return {{load.ellipses, 3}, amounts};
}

/// Points of the file in space: without z_um those of the surface.
std::vector<Vec3> read_points_in_space(const Path& file, const Gel& gel) {
  const files::CsvTable table(file);
  const bool has_depth = table.has("z_um");
  const std::optional<surface::Height> height =
      gel.surface ? std::optional<surface::Height>(*gel.surface) : std::nullopt;
  const Range allowed = height ? Range::any() : Range::not_negative();
  std::vector<Vec3> points;
  for (const Vec2 p : files::read_points(file)) {
    const int row = static_cast<int>(points.size());
    const double of_surface = height ? (*height)(p) : 0;
    points.push_back({p.x, p.y, has_depth ? table.number(row, "z_um", allowed) : of_surface});
  }
  return points;
}

/// displacement_3d.csv at points of the gel's inside or of a surface that is not flat, or by forces into it.
void write_in_space(stage::StageContext& context, const substrate::Substrate& model, const Load& load, const Gel& gel,
                    Figures& figures) {
  const Path file = context.input("points");
  const bool has_depth = files::CsvTable(file).has("z_um");
  const std::vector<Vec3> points = read_points_in_space(file, gel);
  substrate::Observations observed{points, substrate::Components::all};
  if (!has_depth) observed.points_um = files::read_points(file);  // on the surface, to the last digit
  const auto [loads, amounts] = in_space(load);
  const VectorXd u = model.response(loads, observed)->displace(amounts).col(0);
  std::vector<BeadInSpace> field;
  double largest_um = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Eigen::Vector3d at_point = u.segment<3>(3 * static_cast<Index>(i));
    field.push_back({.position_um = points[i],
                     .displacement_um = {at_point.x(), at_point.y(), at_point.z()},
                     .sigma_um = 0,
                     .sigma_z_um = 0,
                     .flag = {}});
    largest_um = std::max(largest_um, at_point.norm());
  }
  files::write_displacement_in_space(context.output("out"), field);
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

/// Where the gel's surface is, and how far it is known.
std::optional<substrate::SurfaceShape> shape_of(const Gel& gel) {
  if (!gel.surface) return std::nullopt;
  const surface::Height height(*gel.surface);
  return substrate::SurfaceShape{height, {height.low_um(), height.high_um()}};
}

void write_result(stage::StageContext& context, const substrate::Substrate& model, const Load& load, const Gel& gel,
                  Figures& figures) {
  if (context.has_input("points")) {
    if (is_in_space(context, load, gel)) return write_in_space(context, model, load, gel, figures);
    return write_at_points(context, model, load, figures);
  }
  if (!load.into_the_gel_nN.empty())
    throw UsageError("expected --points if forces point into the gel: pictures show those along it");
  const Path file = context.output("out");
  if (context.outputs_.at("out").extension() != ".vtu") {
    throw UsageError("expected --points, or an --out that ends with .vtu or volume.vtu");
  }
  if (context.outputs_.at("out").stem().string().ends_with("volume")) {
    if (load.lattice)
      throw UsageError("expected --points or an --out of the surface: volumes are computed of forces on adhesions");
    substrate::write_volume_vtu(file, model.volume(load.ellipses, load.forces_nN));
  } else if (load.lattice) {
    substrate::write_traction_vtu(file, model, load.lattice->mesh, load.lattice->traction_kPa, *shape_of(gel));
  } else {
    substrate::write_substrate_vtu(file, model, load.ellipses, load.forces_nN, substrate::kSurfaceLines, shape_of(gel));
  }
}

/// Along the surface and into the gel; of a lattice the largest.
double traction_of(const Load& load) {
  double largest = 0;
  if (load.lattice) {
    for (Index k = 0; k < load.lattice->traction_kPa.size(); k += 3)
      largest = std::max(largest, load.lattice->traction_kPa.segment<3>(k).norm());
    return largest;
  }
  VectorXd forces_nN(2 * std::ssize(load.ellipses));
  for (std::size_t j = 0; j < load.ellipses.size(); ++j) {
    const double into = load.into_the_gel_nN.empty() ? 0 : load.into_the_gel_nN[j];
    forces_nN.segment<2>(2 * static_cast<Index>(j)) << norm(load.forces_nN[j]), into;
  }
  return choice::mean_traction_kPa(load.ellipses, forces_nN);
}

/// @throws InvalidData as check(gel)
void notice_level(stage::StageContext& context, const Gel& gel) {
  check(gel);
  const auto [low, high] = std::ranges::minmax_element(gel.surface->z_um);
  context.notice(noticed(Symptom::surface_off_zero, std::max({0.0, *low, -*high}) / gel.thickness_um));
}

StageReport run(const Parameters& given, stage::StageContext& context) {
  Parameters parameters = given;
  if (context.has_input("surface")) {
    parameters.gel.surface = std::make_shared<const HeightMap>(files::read_surface(context.input("surface")));
    notice_level(context, parameters.gel);
  }
  Switch& vertical = parameters.substrate.effects.vertical_displacement;
  const Load load = read_load(context, parameters.gel);
  if (vertical == Switch::automatic && (!context.has_input("points") || is_in_space(context, load, parameters.gel)))
    vertical = Switch::on;  // what is written has three components
  const Effect strain =
      choice::decide_large_strain(parameters.substrate, choice::left_out_in_gel(parameters.gel, traction_of(load)));
  parameters.substrate.effects.large_strain = strain.is_on ? Switch::on : Switch::off;
  const auto model = choice::make_substrate(parameters.gel, parameters.substrate, context.threads);
  context.progress(0.1, "solving for the substrate");
  StageReport report;
  write_result(context, *model, load, parameters.gel, report.figures);
  const std::size_t n_loads = load.lattice ? load.lattice->mesh.faces.size() : load.ellipses.size();
  report.summary = std::to_string(n_loads) + " loaded patches, model " + name_of(parameters.substrate.model);
  report.figures.emplace_back("n_loads", static_cast<std::int64_t>(n_loads));
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
  return stage::run_stage<Parameters>({.name = "substrate",
                                       .files = {{"adhesions", Kind::optional_input},
                                                 {"forces", Kind::optional_input},
                                                 {"traction", Kind::optional_input},
                                                 {"surface", Kind::optional_input},
                                                 {"points", Kind::optional_input},
                                                 {"out", Kind::output}}},
                                      argc, argv, run);
}
