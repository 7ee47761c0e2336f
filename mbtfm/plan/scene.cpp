#include "mbtfm/plan/scene.h"

#include <algorithm>
#include <cmath>
#include <map>

#include "mbtfm/tensions/fit_results.h"
#include "pipeline/contract/errors.h"
#include "pipeline/files/csv_files.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::plan {

namespace {

/// No fibre of a cell pulls less in the simulator; and one that hangs loose tells nothing of what a taut one shows.
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

}  // namespace mbtfm::plan
