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
  list.add("layout", p.layout, "spread: a cell at random; dense: with bundles of fibres; ring, line: regular ones");
  list.add("diameter_um", p.diameter_um, Range::size_um(), "diameter of the cell (um)");
  list.add("n_corners", p.n_corners, Range::between(3, 50),
           "number of the outline's corners, which are rich in adhesions");
  list.add("corner_jitter", p.corner_jitter, Range::between(0, 0.4), "scatter of the corners' radii, relative");
  list.add("edge_concavity", p.edge_concavity, Range::between(0, 0.3),
           "depth of the arc between two corners over their distance");
  list.add("elongation", p.elongation, Range::between(1, 20), "long over short diameter of the cell");
  list.add("edge_roughness_um", p.edge_roughness_um, Range::zero_or_size_um(),
           "raggedness of the outline (standard deviation, um)");
  list.add("n_adhesions", p.n_adhesions, Range::between(2, 5000), "number of all adhesions");
  list.add("adhesion_area_um2", p.adhesion_area_um2, Range::area_um2(), "mean area of an adhesion (um²)");
  list.add("smallest_area_um2", p.smallest_area_um2, Range::area_um2(), "smallest area of an adhesion (um²)");
  list.add("largest_area_um2", p.largest_area_um2, Range::area_um2(), "largest area of an adhesion (um²)");
  list.add("smallest_aspect", p.smallest_aspect, Range::between(1, 1000), "least length over width of an adhesion");
  list.add("largest_aspect", p.largest_aspect, Range::between(1, 1000), "largest length over width of an adhesion");
  list.add("adhesion_clearance_um", p.adhesion_clearance_um, Range::zero_or_size_um(),
           "least gap between adhesions, and between an adhesion and a fibre it does not hold (um)");
  list.add("adhesion_stress_kPa", p.adhesion_stress_kPa, Range::modulus_kPa(),
           "an adhesion grows until its fibre pulls no harder than this by area (kPa)");
  list.add("n_ventral", p.n_ventral, Range::between(0, 1000), "number of ventral fibres");
  list.add("n_dorsal", p.n_dorsal, Range::between(0, 1000), "number of dorsal fibres");
  list.add("n_arc", p.n_arc, Range::between(0, 1000), "number of transverse arcs");
  list.add("n_edge", p.n_edge, Range::between(0, 20),
           "number of bundles along concave arcs of the outline (layout dense)");
  list.add("carpet_smallest_um", p.carpet_smallest_um, Range::size_um(),
           "least distance of neighbours in a group of ventral fibres side by side, at its narrow end (um)");
  list.add("carpet_largest_um", p.carpet_largest_um, Range::size_um(),
           "largest distance of neighbours in a group of ventral fibres side by side, at its narrow end (um)");
  list.add("fibre_width_um", p.fibre_width_um, Range::size_um(), "median width of a fibre (um)");
  list.add("fibre_width_log_sd", p.fibre_width_log_sd, Range::between(0, 0.5),
           "standard deviation of the logarithm of the fibres' widths");
  list.add("fibre_spacing_um", p.fibre_spacing_um, Range::size_um(),
           "least gap between fibres that run side by side (um)");
  list.add("free_end_clearance_um", p.free_end_clearance_um, Range::zero_or_size_um(),
           "least gap between a fibre's free end and an adhesion (um)");
  list.add("n_pairs", p.n_pairs, Range::between(0, 1000), "number of ventral fibres with a parallel neighbour");
  list.add("pair_spacing_um", p.pair_spacing_um, Range::size_um(),
           "distance of a ventral fibre and its parallel neighbour (um)");
  list.add("brightness_log_sd", p.brightness_log_sd, Range::between(0, 0.7),
           "standard deviation of the logarithm of the adhesions' and fibres' brightness");
}

void declare_actin(stage::ParameterList& list, ActinParameters& p) {
  list.add("n_ruffles", p.n_ruffles, Range::between(0, 1000),
           "number of ruffles: folds of the membrane near the edge, bright in actin");
  list.add("ruffle_brightness", p.ruffle_brightness, Range::zero_or_factor(),
           "brightness of ruffles over that of adhesions");
  list.add("n_filopodia", p.n_filopodia, Range::between(0, 1000),
           "number of filopodia: spikes of actin beyond the outline");
  list.add("fibre_brightness", p.fibre_brightness, Range::factor(),
           "median brightness of fibres over that of adhesions");
  list.add("fibre_modulation", p.fibre_modulation, Range::between(0, 0.5),
           "variation of a fibre's brightness over some micrometres, relative");
  list.add("fibre_fading", p.fibre_fading, Range::between(0, 0.5),
           "variation of a fibre's brightness over tens of micrometres, relative");
  list.add("cytosol", p.cytosol, Range::zero_or_factor(), "brightness of actin that is in no fibre");
  list.add("bulge", p.bulge, Range::between(0, 1), "share of the cell's thickness around the nucleus only");
  list.add("lamella", p.lamella, Range::between(0, 1), "least share of the cell's thickness, at its edge");
  list.add("clouds", p.clouds, Range::between(0, 0.5),
           "unevenness of the actin that is in no fibre, over micrometres, relative");
  list.add("grain", p.grain, Range::between(0, 0.5),
           "unevenness of the actin that is in no fibre, over the resolution of light, relative");
  list.add("nuclear_shadow", p.nuclear_shadow, Range::between(0, 1),
           "share of the brightness that actin in no fibre loses over the nucleus");
  list.add("nuclear_dimming", p.nuclear_dimming, Range::between(0, 1),
           "share of the brightness that fibres lose over the nucleus");
  list.add("filaments_per_um2", p.filaments_per_um2, Range::between(0, 10),
           "number of thin filaments of the actin meshwork, by area (1/um²)");
  list.add("shortest_filament_um", p.shortest_filament_um, Range::size_um(),
           "length of the shortest filament of the meshwork (um)");
  list.add("longest_filament_um", p.longest_filament_um, Range::size_um(),
           "length of the longest filament of the meshwork (um)");
  list.add("filament_brightness", p.filament_brightness, Range::zero_or_factor(),
           "brightness of the meshwork's brightest filament");
  list.add("filament_bend", p.filament_bend, Range::between(0, 0.5),
           "sag of the meshwork's filaments over their length, standard deviation");
  list.add("edge_brightness", p.edge_brightness, Range::zero_or_factor(), "brightness of the actin along the outline");
}

void declare_tension(stage::ParameterList& list, TensionParameters& p) {
  list.add("dorsal_median_nN", p.dorsal_median_nN, Range::force_nN(), "median tension of dorsal fibres (nN)");
  list.add("dorsal_log_sd", p.dorsal_log_sd, Range::between(0, 5), "spread of its logarithm");
  list.add("ventral_median_nN", p.ventral_median_nN, Range::force_nN(), "median tension of ventral fibres (nN)");
  list.add("ventral_log_sd", p.ventral_log_sd, Range::between(0, 5), "spread of its logarithm");
  list.add("arc_median_nN", p.arc_median_nN, Range::force_nN(), "median tension of transverse arcs (nN)");
  list.add("arc_log_sd", p.arc_log_sd, Range::between(0, 5), "spread of its logarithm");
  list.add("smallest_tension_nN", p.smallest_tension_nN, Range::force_nN(), "smallest tension of a fibre (nN)");
  list.add("largest_tension_nN", p.largest_tension_nN, Range::force_nN(), "largest tension of a fibre (nN)");
  list.add("surface_tension_nN_per_um", p.surface_tension_nN_per_um, Range::zero_or_factor(),
           "surface tension of the actin network (nN/um)");
}

void declare_microscope(stage::ParameterList& list, MicroscopeParameters& p) {
  list.add("image_size_px", p.image_size_px, Range::between(16, 8192), "width and height of the images (pixels)");
  list.add("image_quality", p.image_quality, "light, haze and sharpness of the images");
  list.add("psf_sigma_um", p.psf_sigma_um, Range::size_um(), "standard deviation of the point-spread function (um)");
  list.add("haze", p.haze, Range::zero_or_factor(), "light from out of focus over light in focus");
  list.add("haze_sigma_um", p.haze_sigma_um, Range::size_um(),
           "standard deviation of the spread of light from out of focus (um)");
  list.add("haze_tail", p.haze_tail, Range::zero_or_factor(),
           "light out of focus that falls with the cube of the distance beyond haze_sigma_um, over light in focus");
  list.add("unevenness", p.unevenness, Range::between(0, 0.8), "loss of illumination towards the corners, relative");
  list.add("protein_photons", p.protein_photons, Range::between(1e-6, 1e9),
           "photons by pixel of a bright adhesion or fibre");
  list.add("bead_photons", p.bead_photons, Range::between(1e-6, 1e9), "photons of a bead in focus");
  list.add("bead_sigma_um", p.bead_sigma_um, Range::size_um(), "standard deviation of a bead's image (um)");
  list.add("bead_brightness_log_sd", p.bead_brightness_log_sd, Range::between(0, 5),
           "standard deviation of the logarithm of the beads' brightness");
  list.add("blurred_bead_fraction", p.blurred_bead_fraction, Range::between(0, 1), "share of beads out of focus");
  list.add("counts_per_photon", p.counts_per_photon, Range::factor(), "gain of the camera (counts by photon)");
  list.add("camera_offset", p.camera_offset, Range::between(0, 65535), "counts of the camera in the dark");
  list.add("read_noise", p.read_noise, Range::between(0, 65535),
           "standard deviation of the camera's own noise (counts)");
  list.add("scan_phase_px", p.scan_phase_px, Range::between(-20, 20),
           "shift of the first, third, fifth row and so on to the right of the others, as of a scanner whose way back "
           "is out of time (pixels)");
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
  list.add("pixel_size_um", p.microscope.pixel_size_um, Range::pixel_um(), "side of a pixel on the specimen (um)");
  declare(list, p.gel);
  for (stage::Parameter& q : list.all()) q.is_required = false;  // a scenario's gel has defaults, a real one has not
  list.table("scenario");
  list.add("scenario", p.scenario, "name of a scenario, or path of a scenario file");
  list.add("rough", p.rough, Range::between(0, 1000000),
           "number of a rough day: an acquisition with faults as laboratories have them, drawn by this number; it sets "
           "seed and images, too; 0: none");
  list.add("seed", p.seed, "random seed of the whole experiment");
  list.add("noise", p.noise, Range::zero_or_factor(),
           "standard deviation of the bead displacements over the largest displacement");
  list.add("noise_um", p.noise_um, Range::zero_or_size_um(),
           "standard deviation of the bead displacements as a length (um), in place of `noise`; unset: by `noise`");
  list.add("beads", p.beads, Range::between(1, kMostBeads), "number of beads in the field");
  list.add("beads_per_um2", p.beads_per_um2, Range::between(1e-6, 25),
           "number of beads by area of the field (1/um²), in place of `beads`; unset: by `beads`");
  list.add("images", p.images, "render images in place of the segmentation and the displacement");
  list.add("bead_distance_um", p.bead_distance_um, Range::zero_or_size_um(), "least distance of two beads (um)");
  list.add("lost_bead_fraction", p.lost_bead_fraction, Range::between(0, 1),
           "share of beads that are in one of the two images only");
  list.add("drift_x_um", p.drift_x_um, Range::between(-1000, 1000),
           "shift of the stage to the right, from the relaxed bead image to the pictures with the cell (um)");
  list.add("drift_y_um", p.drift_y_um, Range::between(-1000, 1000),
           "shift of the stage downwards between these images (um)");
  list.add("turn_deg", p.turn_deg, Range::between(-30, 30),
           "turn of the stage between the relaxed bead image and those with the cell, clockwise as seen (degrees)");
  list.add("neighbour_x_um", p.neighbour_x_um, Range::between(-1000, 1000),
           "place of a second cell, from the middle of the field to the right (um); it may lie beyond the border");
  list.add("neighbour_y_um", p.neighbour_y_um, Range::between(-1000, 1000),
           "place of a second cell, from the middle of the field downwards (um)");
  declare_cell(list, p.cell);
  declare_actin(list, p.actin);
  declare_tension(list, p.tension);
  list.add("simulation_edge_length_um", p.mechanics.simulation_edge_length_um, Range::mesh_um(),
           "mean cable length of the simulation's network (um)");
  list.add("simulation_network", p.mechanics.simulation_network,
           "links of the simulation's network: to second neighbours as a reconstruction has them, or along edges only, "
           "with adhesions held all over, at their rims or at their centres");
  list.add("simulation_material", p.mechanics.simulation_material,
           "law of the gel in the simulation: linear, or neo-hooke, whatever the strains are");
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
