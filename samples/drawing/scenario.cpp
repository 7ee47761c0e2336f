#include "samples/drawing/scenario.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/contract/errors.h"
#include "pipeline/contract/listed.h"
#include "pipeline/stage/parameters.h"

namespace mbtfm::drawing {

namespace {

constexpr int kMostBeads = 10'000'000;

void declare_cell(stage::ParameterList& list, CellParameters& p) {
  list.add("layout", p.layout);
  list.add("diameter_um", p.diameter_um, Range::size_um());
  list.add("n_corners", p.n_corners, Range::between(3, 50));
  list.add("corner_jitter", p.corner_jitter, Range::between(0, 0.4));
  list.add("edge_concavity", p.edge_concavity, Range::between(0, 0.3));
  list.add("elongation", p.elongation, Range::between(1, 20));
  list.add("edge_roughness_um", p.edge_roughness_um, Range::zero_or_size_um());
  list.add("n_adhesions", p.n_adhesions, Range::between(2, 5000));
  list.add("adhesion_area_um2", p.adhesion_area_um2, Range::area_um2());
  list.add("smallest_area_um2", p.smallest_area_um2, Range::area_um2());
  list.add("largest_area_um2", p.largest_area_um2, Range::area_um2());
  list.add("smallest_aspect", p.smallest_aspect, Range::between(1, 1000));
  list.add("largest_aspect", p.largest_aspect, Range::between(1, 1000));
  list.add("adhesion_clearance_um", p.adhesion_clearance_um, Range::zero_or_size_um());
  list.add("adhesion_stress_kPa", p.adhesion_stress_kPa, Range::modulus_kPa());
  list.add("n_ventral", p.n_ventral, Range::between(0, 1000));
  list.add("n_dorsal", p.n_dorsal, Range::between(0, 1000));
  list.add("n_arc", p.n_arc, Range::between(0, 1000));
  list.add("n_edge", p.n_edge, Range::between(0, 20));
  list.add("carpet_smallest_um", p.carpet_smallest_um, Range::size_um());
  list.add("carpet_largest_um", p.carpet_largest_um, Range::size_um());
  list.add("fibre_width_um", p.fibre_width_um, Range::size_um());
  list.add("fibre_width_log_sd", p.fibre_width_log_sd, Range::between(0, 0.5));
  list.add("fibre_spacing_um", p.fibre_spacing_um, Range::size_um());
  list.add("free_end_clearance_um", p.free_end_clearance_um, Range::zero_or_size_um());
  list.add("n_pairs", p.n_pairs, Range::between(0, 1000));
  list.add("pair_spacing_um", p.pair_spacing_um, Range::size_um());
  list.add("brightness_log_sd", p.brightness_log_sd, Range::between(0, 0.7));
}

void declare_actin(stage::ParameterList& list, ActinParameters& p) {
  list.add("n_ruffles", p.n_ruffles, Range::between(0, 1000));
  list.add("ruffle_brightness", p.ruffle_brightness, Range::zero_or_factor());
  list.add("n_filopodia", p.n_filopodia, Range::between(0, 1000));
  list.add("fibre_brightness", p.fibre_brightness, Range::factor());
  list.add("fibre_modulation", p.fibre_modulation, Range::between(0, 0.5));
  list.add("fibre_fading", p.fibre_fading, Range::between(0, 0.5));
  list.add("cytosol", p.cytosol, Range::zero_or_factor());
  list.add("bulge", p.bulge, Range::between(0, 1));
  list.add("lamella", p.lamella, Range::between(0, 1));
  list.add("clouds", p.clouds, Range::between(0, 0.5));
  list.add("grain", p.grain, Range::between(0, 0.5));
  list.add("nuclear_shadow", p.nuclear_shadow, Range::between(0, 1));
  list.add("nuclear_dimming", p.nuclear_dimming, Range::between(0, 1));
  list.add("filaments_per_um2", p.filaments_per_um2, Range::between(0, 10));
  list.add("shortest_filament_um", p.shortest_filament_um, Range::size_um());
  list.add("longest_filament_um", p.longest_filament_um, Range::size_um());
  list.add("filament_brightness", p.filament_brightness, Range::zero_or_factor());
  list.add("filament_bend", p.filament_bend, Range::between(0, 0.5));
  list.add("edge_brightness", p.edge_brightness, Range::zero_or_factor());
}

void declare_tension(stage::ParameterList& list, TensionParameters& p) {
  list.add("dorsal_median_nN", p.dorsal_median_nN, Range::force_nN());
  list.add("dorsal_log_sd", p.dorsal_log_sd, Range::between(0, 5));
  list.add("ventral_median_nN", p.ventral_median_nN, Range::force_nN());
  list.add("ventral_log_sd", p.ventral_log_sd, Range::between(0, 5));
  list.add("arc_median_nN", p.arc_median_nN, Range::force_nN());
  list.add("arc_log_sd", p.arc_log_sd, Range::between(0, 5));
  list.add("smallest_tension_nN", p.smallest_tension_nN, Range::force_nN());
  list.add("largest_tension_nN", p.largest_tension_nN, Range::force_nN());
  list.add("surface_tension_nN_per_um", p.surface_tension_nN_per_um, Range::zero_or_factor());
}

void declare_microscope(stage::ParameterList& list, MicroscopeParameters& p) {
  list.add("image_size_px", p.image_size_px, Range::between(16, 8192));
  list.add("image_quality", p.image_quality);
  list.add("psf_sigma_um", p.psf_sigma_um, Range::size_um());
  list.add("haze", p.haze, Range::zero_or_factor());
  list.add("haze_sigma_um", p.haze_sigma_um, Range::size_um());
  list.add("haze_tail", p.haze_tail, Range::zero_or_factor());
  list.add("unevenness", p.unevenness, Range::between(0, 0.8));
  list.add("protein_photons", p.protein_photons, Range::between(1e-6, 1e9));
  list.add("bead_photons", p.bead_photons, Range::between(1e-6, 1e9));
  list.add("bead_sigma_um", p.bead_sigma_um, Range::size_um());
  list.add("bead_brightness_log_sd", p.bead_brightness_log_sd, Range::between(0, 5));
  list.add("blurred_bead_fraction", p.blurred_bead_fraction, Range::between(0, 1));
  list.add("counts_per_photon", p.counts_per_photon, Range::factor());
  list.add("camera_offset", p.camera_offset, Range::between(0, 65535));
  list.add("read_noise", p.read_noise, Range::between(0, 65535));
  list.add("scan_phase_px", p.scan_phase_px, Range::between(-20, 20));
}

/// Beside the folder of the program, in an installation as in a build.
fs::path scenario_folder() {
  return fs::read_symlink("/proc/self/exe").parent_path().parent_path() / "share/mbtfm/scenarios";
}

std::string known_scenarios() {
  std::vector<std::string> names;
  std::error_code is_missing;
  for (const auto& entry : fs::directory_iterator(scenario_folder(), is_missing))
    if (entry.path().extension() == ".toml") names.push_back(entry.path().stem().string());
  std::ranges::sort(names);
  return listed(names);
}

}  // namespace

void declare(stage::ParameterList& list, ScenarioParameters& p) {
  list.table("");
  list.add("pixel_size_um", p.microscope.pixel_size_um, Range::pixel_um());
  declare(list, p.gel);
  for (stage::Parameter& q : list.all()) q.is_required = false;  // a scenario's gel has defaults, a real one has not
  list.table("scenario");
  list.add("scenario", p.scenario);
  list.add("rough", p.rough, Range::between(0, 1000000));
  list.add("seed", p.seed);
  list.add("noise", p.noise, Range::zero_or_factor());
  list.add("noise_um", p.noise_um, Range::zero_or_size_um());
  list.add("beads", p.beads, Range::between(1, kMostBeads));
  list.add("beads_per_um2", p.beads_per_um2, Range::between(1e-6, 25));
  list.add("images", p.images);
  list.add("bead_distance_um", p.bead_distance_um, Range::zero_or_size_um());
  list.add("lost_bead_fraction", p.lost_bead_fraction, Range::between(0, 1));
  list.add("drift_x_um", p.drift_x_um, Range::between(-1000, 1000));
  list.add("drift_y_um", p.drift_y_um, Range::between(-1000, 1000));
  list.add("turn_deg", p.turn_deg, Range::between(-30, 30));
  list.add("neighbour_x_um", p.neighbour_x_um, Range::between(-1000, 1000));
  list.add("neighbour_y_um", p.neighbour_y_um, Range::between(-1000, 1000));
  declare_cell(list, p.cell);
  declare_actin(list, p.actin);
  declare_tension(list, p.tension);
  list.add("simulation_edge_length_um", p.mechanics.simulation_edge_length_um, Range::mesh_um());
  list.add("simulation_network", p.mechanics.simulation_network);
  list.add("simulation_material", p.mechanics.simulation_material);
  declare_microscope(list, p.microscope);
  declare(list, p.faults);
}

namespace {

/// About the picture's centre; a turn of 0 leaves the bits as they are.
Vec2 turned(Vec2 place_um, double angle_deg, const MicroscopeParameters& m) {
  if (angle_deg == 0) return place_um;
  const Vec2 centre = 0.5 * field_um(m) * Vec2{1, 1};
  const double angle_rad = angle_deg * std::numbers::pi / 180, c = std::cos(angle_rad), s = std::sin(angle_rad);
  const Vec2 d = place_um - centre;
  return centre + Vec2{c * d.x - s * d.y, s * d.x + c * d.y};
}

}  // namespace

Vec2 moved_by_stage(Vec2 place_um, const ScenarioParameters& p) {
  return turned(place_um, p.turn_deg, p.microscope) + Vec2{p.drift_x_um, p.drift_y_um};
}

Vec2 before_stage_moved(Vec2 place_um, const ScenarioParameters& p) {
  return turned(place_um - Vec2{p.drift_x_um, p.drift_y_um}, -p.turn_deg, p.microscope);
}

int n_beads(const ScenarioParameters& p) {
  if (!p.beads_per_um2) return p.beads;
  const double side_um = field_um(p.microscope);
  return static_cast<int>(std::clamp(std::round(*p.beads_per_um2 * side_um * side_um), 1.0, double(kMostBeads)));
}

fs::path scenario_file(const std::string& name) {
  if (name.find('/') != name.npos || name.ends_with(".toml")) {
    if (!fs::is_regular_file(name)) throw UsageError("--scenario: there is no file " + name);
    return name;
  }
  if (const fs::path file = scenario_folder() / (name + ".toml"); fs::is_regular_file(file)) return file;
  const std::string known = known_scenarios();
  throw UsageError("--scenario: '" + name + "' is unknown; " +
                   (known.empty() ? "there are none in " + scenario_folder().string() + ": is mbtfm installed whole?"
                                  : "there are " + known + ", or give the path of a scenario file"));
}

}  // namespace mbtfm::drawing
