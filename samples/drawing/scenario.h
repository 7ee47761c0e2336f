/// A scenario: everything a synthetic experiment is made of. A scenario file holds what differs from the defaults.
#pragma once

#include <cmath>
#include <cstdint>
#include <optional>
#include <string>

#include "pipeline/contract/gel.h"
#include "pipeline/contract/geometry.h"
#include "pipeline/contract/path.h"
#include "pipeline/stage/parameters_fwd.h"
#include "samples/drawing/faults.h"

namespace mbtfm::drawing {

enum class Layout {
  spread,  ///< fibres well apart, at random
  dense,   ///< in bundles
  ring,    ///< regular, for known answers
  line     ///< likewise
};
constexpr auto words(Layout) { return std::array{"spread", "dense", "ring", "line"}; }

/// What the cell looks like. Defaults: a spread U2OS cell on fibronectin, as in thesis 3.4.
struct CellParameters {
  Layout layout = Layout::spread;
  double diameter_um = 66;             ///< mean, over the corners
  int n_corners = 9;                   ///< adhesion-rich corners with concave arcs between them
  double corner_jitter = 0.1;          ///< of a corner's radius, relative (standard deviation)
  double edge_concavity = 0.08;        ///< depth of the arc between two corners over their distance
  double elongation = 1.15;            ///< long over short diameter
  double edge_roughness_um = 0;        ///< standard deviation: smooth; real edges are ragged by their filopodia
  int n_adhesions = 170;               ///< thesis 3.4: 3 612 adhesions in 21 cells
  double adhesion_area_um2 = 0.46;     ///< mean (thesis 3.4)
  double smallest_area_um2 = 0.1;      ///< about the resolution of the microscope
  double largest_area_um2 = 3.0;       ///< super-mature adhesions at strong fibres
  double smallest_aspect = 1.5;        ///< length over width
  double largest_aspect = 4;           ///< length over width
  double adhesion_clearance_um = 0.3;  ///< free rim around each adhesion: two PSF widths keep them apart
  double adhesion_stress_kPa = 5.5;    ///< an adhesion grows to carry its fibre (Balaban 2001: 5.5 nN/um²)
  int n_ventral = 7;                   ///< 369 fibres in 21 cells: 18 a cell
  int n_dorsal = 7;
  int n_arc = 6;
  int n_edge = 0;                   ///< bundles along concave arcs of the outline, between adhesions (dense only)
  double carpet_smallest_um = 0.6;  ///< distance of neighbours at a carpet's narrow end: as near as light resolves …
  double carpet_largest_um = 2;     ///< … and as far as the next peak lies beside most fibres of real cells
  double fibre_width_um = 0.6;      ///< median
  double fibre_width_log_sd = 0;    ///< all alike
  double fibre_spacing_um = 2.0;    ///< least distance of fibres that run alongside; crossing is free
  double free_end_clearance_um = 1.5;  ///< from a fibre's free end to the nearest adhesion: its type stays clear
  int n_pairs = 0;                     ///< ventral fibres that come with a parallel neighbour
  double pair_spacing_um = 1.2;        ///< of the neighbours: two fibre widths
  double brightness_log_sd = 0.25;     ///< of adhesions and fibres: they differ by a quarter
};

/// What actin looks like besides the course of its fibres. Brightness is relative to that of an adhesion.
struct ActinParameters {
  int n_ruffles = 0;                  ///< folds of the membrane near the edge, bright in actin
  double ruffle_brightness = 1;       ///< 0.5 to 1.2 of this
  int n_filopodia = 0;                ///< spikes beyond the outline
  double fibre_brightness = 1;        ///< median
  double fibre_modulation = 0.12;     ///< of the brightness along a fibre, over some micrometres
  double fibre_fading = 0;            ///< the same over tens of micrometres: bundles gain and lose filaments
  double cytosol = 0.16;              ///< where the cell is thickest
  double bulge = 0.65;                ///< part of the thickness that the lamella lacks
  double lamella = 0;                 ///< least part of it: the lamella's own thickness
  double clouds = 0;                  ///< uneven cytosol over four micrometres, relative standard deviation
  double grain = 0;                   ///< the same over the resolution of light: dots and pits
  double nuclear_shadow = 0;          ///< loss of cytosol over the nucleus, which lifts the cell out of focus
  double nuclear_dimming = 0;         ///< loss of the fibres' brightness there
  double filaments_per_um2 = 0.8;     ///< thin ones, of the cortical mesh
  double shortest_filament_um = 2;    ///< shorter ones make grains
  double longest_filament_um = 6;     ///< of thin filaments
  double filament_brightness = 0.14;  ///< of the brightest
  double filament_bend = 0;           ///< sag over length, standard deviation: straight
  double edge_brightness = 0.18;      ///< of the cortex along the outline
};

/// Tensions by fibre type: log-normal, after the histograms of thesis fig. 3.14.
struct TensionParameters {
  double dorsal_median_nN = 0.8;  ///< 57 % below 1 nN, 9 % above 5 nN
  double dorsal_log_sd = 1.5;
  double ventral_median_nN = 3.8;  ///< 33 % above 5 nN
  double ventral_log_sd = 1.0;
  double arc_median_nN = 1.7;  ///< between the two
  double arc_log_sd = 1.2;
  double smallest_tension_nN = 0.05;
  double largest_tension_nN = 15;
  /// Of the actin network: 0.06 nN a cable on a mesh of 1.5 um (thesis 3.3) as a property of no mesh.
  double surface_tension_nN_per_um = std::sqrt(3.0) * 0.06 / 1.5;
};

/// What a simulated cell's network is made of: links to second neighbours, as the reconstruction's, or along the edges
/// of the triangles alone, adhesions held all over, at their rims or at their centres.
enum class TrueNetwork { second_neighbours, edges, edges_rims, edges_centres };
constexpr auto words(TrueNetwork) { return std::array{"second-neighbours", "edges", "edges-rims", "edges-centres"}; }

/// The simulation's own mechanics, finer than what a reconstruction uses.
struct MechanicsParameters {
  double simulation_edge_length_um = 0.9;  ///< of its network: well below the 1.5 um of a reconstruction
  TrueNetwork simulation_network = TrueNetwork::second_neighbours;
  MaterialLaw simulation_material = MaterialLaw::linear;
};

enum class ImageQuality { good, ordinary, poor };
constexpr auto words(ImageQuality) { return std::array{"good", "ordinary", "poor"}; }

/// The microscope and its camera.
struct MicroscopeParameters {
  double pixel_size_um = 0.1;  ///< 60x to 63x on a 6.5 um camera
  int image_size_px = 1024;    ///< the field is square
  ImageQuality image_quality = ImageQuality::ordinary;
  double psf_sigma_um = 0.13;    ///< 0.21 · 560 nm / NA 0.9 … 1.2, slightly out of focus
  double haze = 0.35;            ///< light from out of focus, relative to that in focus
  double haze_sigma_um = 3;      ///< how far it spreads
  double haze_tail = 0;          ///< light that spreads with the inverse cube of the distance, beyond that
  double unevenness = 0.25;      ///< of the illumination, centre to corner
  double protein_photons = 500;  ///< of a bright adhesion or fibre, by pixel
  double bead_photons = 4000;    ///< of a bead in focus, all of its pixels
  double bead_sigma_um = 0.15;   ///< image of a 0.2 um bead through the PSF
  double bead_brightness_log_sd = 0.25;
  double blurred_bead_fraction = 0.1;  ///< of the beads lie deeper and appear wider and dimmer
  double counts_per_photon = 2;
  double camera_offset = 200;  ///< counts
  double read_noise = 3;       ///< counts
  double scan_phase_px = 0;    ///< of the rows of the way there against those of the way back, in all images
};

struct ScenarioParameters {
  std::string scenario = "u2os";
  int rough = 0;  ///< the day's number (rough_day.h); 0: nothing goes wrong unasked
  std::uint64_t seed = 1;
  double noise = 0.07;                       ///< thesis 3.2.4: experiments have 5 to 10 %
  std::optional<double> noise_um = {};       ///< a microscope's noise is in um, whatever the gel; unset: by `noise`
  int beads = 10000;                         ///< one for each um² of the default field
  std::optional<double> beads_per_um2 = {};  ///< unset: by `beads`
  bool images = false;
  double bead_distance_um = 0.4;      ///< least: the images of nearer ones would melt together
  double lost_bead_fraction = 0.015;  ///< of the beads are in one of the two images only
  double drift_x_um = 0;              ///< of the stage, from the relaxed picture to those with the cell
  double drift_y_um = 0;
  double turn_deg = 0;  ///< the same, about the picture's centre, from +x towards +y
  /// Centre of another cell from this one's, which is drawn from the next seed and pulls, too. Both unset: none.
  std::optional<double> neighbour_x_um{}, neighbour_y_um{};
  CellParameters cell;
  ActinParameters actin;
  TensionParameters tension;
  MechanicsParameters mechanics;
  MicroscopeParameters microscope;
  FaultParameters faults;
  Gel gel{.youngs_modulus_kPa = 8.4, .poisson_ratio = 0.49, .thickness_um = 60};  ///< polyacrylamide of thesis 3.4
};
void declare(stage::ParameterList& list, ScenarioParameters& parameters);

/// Side of the square field of view.
inline double field_um(const MicroscopeParameters& m) { return m.pixel_size_um * m.image_size_px; }

/// Where the stage carried a place of the relaxed picture (um) before the pictures with the cell were taken. The cell
/// and its truth are in the frame of the latter.
Vec2 moved_by_stage(Vec2 place_um, const ScenarioParameters& parameters);
/// Its inverse.
Vec2 before_stage_moved(Vec2 place_um, const ScenarioParameters& parameters);

/// Beads in the field, however that was asked for.
int n_beads(const ScenarioParameters& parameters);

/// The file of a scenario: a name of those that come with the program, or a path.
/// @throws UsageError listing what there is
fs::path scenario_file(const std::string& name_or_path);

}  // namespace mbtfm::drawing
