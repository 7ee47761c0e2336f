#include "samples/plan/scene.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>

#include "continuum/sheet/parameters.h"
#include "mbtfm/spatial/stage.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/numbers.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/files/space_files.h"
#include "pipeline/files/vtk_files.h"
#include "pipeline/numerics/order_statistics.h"
#include "pipeline/report/texts.h"
#include "pipeline/stage/parameters.h"
#include "samples/colonies/parameters.h"
#include "samples/gels/folder.h"
#include "samples/gels/scene.h"
#include "substrate/surface/height.h"

namespace mbtfm::plan {

namespace {

/// No fibre of a cell pulls less in the simulator; and a loose one shows nothing of a taut one's effect.
constexpr double kLeastTension_nN = 0.05;

Extent whole_field(const drawing::MicroscopeParameters& m) {
  return {{0, 0}, {drawing::field_um(m), drawing::field_um(m)}};
}

}  // namespace

Scene simulated_scene(const Parameters& parameters) {
  Scene scene;
  drawing::ScenarioParameters& p = scene.experiment;
  stage::ParameterList list;
  declare(list, p);
  stage::read_toml(list, drawing::scenario_file(parameters.scenario));
  p.scenario = parameters.scenario;
  p.seed = parameters.seed;
  scene.name = "scenario " + p.scenario + ", seed " + std::to_string(p.seed);
  scene.cell = drawing::draw_cell(p.cell, p.tension, drawing::field_um(p.microscope), p.seed);
  scene.field = whole_field(p.microscope);
  scene.fit.gel = p.gel;
  scene.fit = fit::as_switched(scene.fit);
  return scene;
}

Scene measured_scene(const std::filesystem::path& folder, const Parameters& parameters) {
  Scene scene;
  scene.name = "cell " + std::filesystem::weakly_canonical(folder).filename().string();
  stage::ParameterList list;
  declare(list, scene.fit);
  stage::read_toml(list, folder / "cell.toml");
  stage::check_complete(list);
  scene.fit = fit::as_switched(scene.fit);
  scene.cell.cell = files::read_cell(folder / "1_segment");
  std::map<int, double> tensions_nN;
  for (const Tension& t : files::read_tensions(folder / "4_fit/tensions.csv")) tensions_nN[t.fibre_id] = t.tension_nN;
  for (const Fibre& f : scene.cell.cell.fibres) {
    if (!tensions_nN.contains(f.fibre_id))
      throw InputError((folder / "4_fit/tensions.csv").string(), "a tension of each fibre of 1_segment/fibres.csv",
                       "none of fibre " + std::to_string(f.fibre_id), "run the cell again: mbtfm run");
    scene.cell.tensions_nN.push_back(std::max(kLeastTension_nN, tensions_nN[f.fibre_id]));
  }
  const DisplacementField beads = files::read_displacement(folder / "2_track/displacement.csv");
  if (beads.empty()) throw InputError((folder / "2_track/displacement.csv").string(), "beads", "none");
  scene.field = extent_of(points_of(beads));
  drawing::ScenarioParameters& p = scene.experiment;
  p.seed = parameters.seed;
  p.gel = scene.fit.gel;
  // the simulator's tension is that of a mesh of its reference edge, the fit's that of its own
  p.tension.surface_tension_nN_per_um =
      std::sqrt(3.0) * std::max(1e-3, tensions_nN[0]) / scene.fit.network.edge_length_um;
  const Vec2 size = scene.field.high_um - scene.field.low_um;
  p.microscope.image_size_px = 1 + static_cast<int>(std::max(size.x, size.y) / p.microscope.pixel_size_um);
  return scene;
}

std::vector<Vec2> beads_on(const Scene& scene, double beads_per_um2, std::uint64_t draw) {
  constexpr std::uint64_t kDraws = 0x706c616e;  // far from the seeds of people
  drawing::ScenarioParameters p = scene.experiment;
  p.beads_per_um2 = beads_per_um2;
  p.seed += kDraws + 1000 * draw;
  std::vector<Vec2> beads_um;
  for (const Vec2 place : experiment::place_beads(p)) {
    const Vec2 at = scene.field.low_um + place;
    if (at.x <= scene.field.high_um.x && at.y <= scene.field.high_um.y) beads_um.push_back(at);
  }
  return beads_um;
}

// --- in space

namespace {

struct Scenario {
  drawing::ScenarioParameters cell;
  gels::SpaceParameters space;
  colonies::ColonyParameters colony;
  sheet::SheetParameters sheet;
};

Scenario scenario_of(const Parameters& parameters) {
  Scenario s;
  stage::ParameterList list;
  declare(list, s.cell);
  declare(list, s.space);
  declare(list, s.colony);
  declare(list, s.sheet);
  stage::read_toml(list, drawing::scenario_file(parameters.scenario));
  s.cell.scenario = parameters.scenario;
  s.cell.seed = parameters.seed;
  return s;
}

/// The disc whose even load has the second moments of the bump (1 − r²/a²)², a² / 4 and not R² / 2: beads some way off
/// see no others.
Adhesion adhesion_of(const gels::Patch& patch, int adhesion_id) {
  const double radius_um = patch.radius_um / std::numbers::sqrt2;
  return {.adhesion_id = adhesion_id,
          .position_um = {patch.centre_um.x, patch.centre_um.y},
          .area_um2 = std::numbers::pi * radius_um * radius_um,
          .major_axis_um = 2 * radius_um,
          .minor_axis_um = 2 * radius_um};
}

/// The rectangle that beads lie in, and their depth below the surface.
void set_volume(SpaceScene& scene, const std::vector<BeadInSpace>& beads) {
  const surface::Height height(*scene.gel.surface);
  std::vector<double> depths;
  for (const BeadInSpace& bead : beads) {
    const Vec2 at{bead.position_um.x, bead.position_um.y};
    if (!bead.flag.empty() || !height.contains(at)) continue;
    if (depths.empty()) scene.low_um = scene.high_um = at;
    scene.low_um = {std::min(scene.low_um.x, at.x), std::min(scene.low_um.y, at.y)};
    scene.high_um = {std::max(scene.high_um.x, at.x), std::max(scene.high_um.y, at.y)};
    depths.push_back(std::max(0.0, bead.position_um.z - height(at)));
  }
  constexpr std::size_t kFewest = 10;
  if (depths.size() < kFewest)
    throw InputError("2_track/displacement_3d.csv", "at least 10 beads below the surface, not flagged",
                     std::to_string(depths.size()), "run the cell again: mbtfm run");
  scene.bead_depth_um = numerics::quantile(depths, 0.95);  // a few may be outliers
  scene.own_beads_per_um3 = static_cast<double>(depths.size()) / scene.volume_um3();
}

std::vector<SpacePatch> patches_of(const std::filesystem::path& folder) {
  const std::filesystem::path file = folder / "4_traction/traction_adhesion_forces.csv";
  constexpr const char* kRemedy =
      "a plan asks for the forces of adhesions: give their image, and run the cell again: mbtfm run";
  if (!std::filesystem::exists(file))
    throw InputError(file.string(), "forces of the cell's adhesions", "no such file", kRemedy);
  const std::vector<PartForce> forces = files::read(file, files::part_force_table());
  std::vector<SpacePatch> patches;
  for (const Adhesion& a : files::read_adhesions(folder / "1_segment/adhesions.csv"))
    for (const PartForce& f : forces)
      if (f.adhesion_id == a.adhesion_id) patches.push_back({a, f.force_nN});
  if (patches.empty())
    throw InputError(file.string(), "forces of the adhesions of 1_segment/adhesions.csv", "none of them", kRemedy);
  return patches;
}

}  // namespace

std::vector<Adhesion> adhesions_of(const SpaceScene& scene) {
  std::vector<Adhesion> adhesions;
  for (const SpacePatch& patch : scene.patches) adhesions.push_back(patch.adhesion);
  return adhesions;
}

bool is_in_space(const Parameters& parameters) {
  const Scenario s = scenario_of(parameters);
  if (s.colony.shape != colonies::Shape::none)
    throw UsageError("scenario: " + parameters.scenario +
                     " is a sheet without fibres, and a plan asks for tensions of fibres. Simulate it (mbtfm-simulate) "
                     "and fit it (mbtfm-sheet), as docs/sheets.md shows: sheet_fit.csv has the standard errors");
  return s.space.scene != gels::SpaceScene::none;
}

SpaceScene simulated_in_space(const Parameters& parameters, int threads) {
  Scenario s = scenario_of(parameters);
  const int n_beads = s.cell.beads;
  s.cell.beads = 1;  // they come later
  const gels::GelScene simulated = gels::simulate(s.space, gels::size_of(s.cell), threads);
  SpaceScene scene{.name = "scenario " + s.cell.scenario + ", seed " + std::to_string(s.cell.seed),
                   .seed = s.cell.seed,
                   .gel = simulated.gel,
                   .patches = {},
                   .low_um = {0, 0},
                   .high_um = {simulated.field_um, simulated.field_um},
                   .bead_depth_um = s.space.bead_depth_um};
  scene.gel.surface = std::make_shared<const HeightMap>(gels::map_of(simulated));
  for (const gels::Patch& patch : simulated.patches)
    scene.patches.push_back({adhesion_of(patch, static_cast<int>(scene.patches.size()) + 1), patch.force_nN});
  scene.exact_um = [field = simulated.exact()](const Vec3& at) {
    const Eigen::Vector3d u = field.displacement_um({at.x, at.y, at.z});
    return Vec3{u.x(), u.y(), u.z()};
  };
  scene.own_beads_per_um3 = n_beads / scene.volume_um3();
  scene.spatial.axial_sigma_ratio = parameters.axial_noise;
  return scene;
}

bool is_cell_in_space(const std::filesystem::path& folder) {
  return std::filesystem::exists(folder / "2_track/displacement_3d.csv");
}

namespace {

/// In a plan no bead is an outlier: mixture is then least squares to the last digit, and other losses are not.
std::vector<std::string> warnings_of(spatial::BeadLoss loss) {
  using enum spatial::BeadLoss;
  if (loss == l2 || loss == mixture) return {};
  return {report::sentence("plan.other-loss", name_of(loss))};
}

}  // namespace

SpaceScene measured_in_space(const std::filesystem::path& folder, const Parameters& parameters) {
  spatial::StageParameters p;
  stage::ParameterList list;
  declare(list, p);
  stage::read_toml(list, folder / "cell.toml");
  stage::check_complete(list);
  using enum tractions::TractionMethod;
  if (p.traction.method && *p.traction.method != tikhonov && *p.traction.method != group_l1)
    throw UsageError(
        std::string("traction.method = ") + name_of(*p.traction.method) +
        ": a plan knows the standard errors of tikhonov and group-l1, whose forces on adhesions are alike");
  SpaceScene scene{.name = "cell " + std::filesystem::weakly_canonical(folder).filename().string(),
                   .seed = parameters.seed,
                   .gel = p.gel,
                   .patches = patches_of(folder),
                   .traction = p.traction,
                   .spatial = p.spatial,
                   .substrate = p.substrate};
  scene.warnings = warnings_of(p.spatial.loss);
  scene.spatial.loss = spatial::BeadLoss::l2;
  scene.traction.method.reset();
  scene.substrate.effects.large_strain = Switch::off;
  scene.spatial.axial_sigma_ratio = parameters.axial_noise;
  scene.gel.surface = std::make_shared<const HeightMap>(files::read_surface(folder / "3_surface/surface.vtp"));
  const std::filesystem::path outline = folder / "1_segment/outline.csv";
  if (std::filesystem::exists(outline)) scene.outline_um = files::read_outline(outline).front();
  set_volume(scene, files::read_displacement_in_space(folder / "2_track/displacement_3d.csv"));
  return scene;
}

std::vector<BeadInSpace> beads_in(const SpaceScene& scene, std::size_t n_beads, drawing::Random& random) {
  const surface::Height height(*scene.gel.surface);
  std::vector<BeadInSpace> beads(n_beads);
  for (BeadInSpace& bead : beads) {
    const double x = random.uniform(scene.low_um.x, scene.high_um.x),
                 y = random.uniform(scene.low_um.y, scene.high_um.y);
    const double top = height({x, y});
    bead.position_um = {x, y, random.uniform(top, std::min(top + scene.bead_depth_um, scene.gel.thickness_um))};
  }
  return beads;
}

Asked asked_in_space(const Parameters& parameters, const SpaceScene& scene) {
  if (parameters.beads_per_um2 != Parameters{}.beads_per_um2)
    throw UsageError("beads_per_um2: beads of a cell in space fill a volume: give beads_per_um3, " +
                     brief(scene.own_beads_per_um3) + " is this cell's own");
  Parameters in_space = parameters;
  if (in_space.beads_per_um3.empty())
    for (const double factor : {0.5, 1.0, 2.0})
      in_space.beads_per_um3 += (factor > 0.5 ? "," : "") + brief(factor * scene.own_beads_per_um3);
  if (!in_space.tension_nN) {
    std::vector<double> forces;
    for (const SpacePatch& patch : scene.patches) forces.push_back(norm(patch.force_nN));
    in_space.tension_nN = numerics::median_in(forces);
  }
  return asked_by(in_space, scene.gel.youngs_modulus_kPa);
}

}  // namespace mbtfm::plan
