/// Displacement of the substrate from two images of its beads: pulled by the cell, and relaxed.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "pipeline/contract/affine_motion.h"
#include "pipeline/contract/beads.h"
#include "pipeline/contract/effects.h"
#include "pipeline/contract/errors.h"
#include "pipeline/contract/geometry.h"
#include "pipeline/contract/work.h"
#include "pipeline/stage/parameters_fwd.h"
#include "segment/beads/placement.h"
#include "segment/images/image.h"

namespace mbtfm::beads {

/// What is followed from one image to the other.
enum class TrackMethod {
  automatic,   ///< single beads; where they cannot be followed, in parts of the picture or all of it, windows
  beads,       ///< each bead by itself
  correlation  ///< the texture in windows on a lattice, whatever it shows
};
constexpr auto words(TrackMethod) { return std::array{"auto", "beads", "correlation"}; }

/// Of a displacement field from elsewhere.
enum class LengthUnit {
  automatic,  ///< as its header, or the program that wrote it, has it
  um,
  px,  ///< 0 at the centre of the first pixel
  mm,
  m
};
constexpr auto words(LengthUnit) { return std::array{"auto", "um", "px", "mm", "m"}; }

/// The program that wrote it.
enum class TableForm { automatic, plain, openpiv, pivlab, imagej_piv, davis, tecplot, trackmate, pytfm };
constexpr auto words(TableForm) {
  return std::array{"auto", "plain", "openpiv", "pivlab", "imagej-piv", "davis", "tecplot", "trackmate", "pytfm"};
}

/// Where its y points.
enum class VerticalAxis {
  automatic,  ///< up if it falls from row to row of a lattice, which programs write from the top of the picture
  down,
  up  ///< about the middle of its places
};
constexpr auto words(VerticalAxis) { return std::array{"auto", "down", "up"}; }

/// Where a table of another program has its places.
enum class TablePlaces {
  automatic,  ///< as `cell`; asked for if the table holds a drift
  cell,       ///< in the cell's pictures, at rest
  relaxed     ///< in the relaxed picture, from which the stage moved by the motion that all have in common
};
constexpr auto words(TablePlaces) { return std::array{"auto", "cell", "relaxed"}; }

struct TrackParameters {
  std::optional<double> pixel_size_um;        ///< unset: from the images' own calibration
  std::optional<double> beads_pixel_size_um;  ///< of the bead images alone; unset: as all
  images::PlaneChoice stressed_plane;         ///< of a time series the first
  images::PlaneChoice relaxed_plane;
  int stressed_last = 0;                        ///< of a time series the last time or page; 0: a single image
  CellWith cell_with = CellWith::stressed;      ///< a cell is recorded with the beads that it pulls, then removed
  TrackMethod method = TrackMethod::automatic;  ///< single beads know most where they are resolved
  double detection_snr = 5;            ///< below 5 sd of the noise, chance maxima of a 1024² image become beads
  double largest_displacement_um = 0;  ///< beyond it a match is not looked for; 0: a quarter of a search window
  /// A stage drifts; a dish put back on it is turned, a gel swells, a stage tilts or heats, too.
  Switch drift_affine = Switch::off;
  bool is_series = false;          ///< all frames have the same beads, so that no gaps are filled
  bool may_push = false;           ///< a gel that is pushed outward is no sign of exchanged images
  double effect_tolerance = 0.01;  ///< auto: what displaces the border by less, of the largest displacement, stays
  double least_similarity = 0.6;   ///< correlation of a bead's neighbourhoods below which it is no match
  double windows_spacing_um = 0;   ///< of a lattice of windows beside the beads; 0: none
  double outlier_threshold = 4;    ///< in robust sd: 4 rejects one good bead in 16 000
  // a displacement field from elsewhere
  std::string x_column = "x_um", y_column = "y_um", ux_column = "ux_um", uy_column = "uy_um";
  std::string sigma_column = "sigma_um";  ///< need not be there
  TableForm table = TableForm::automatic;
  LengthUnit length_unit = LengthUnit::automatic;
  VerticalAxis y_axis = VerticalAxis::automatic;
  std::optional<double> seconds_between{};  ///< velocities are displacements over this time
  TablePlaces places = TablePlaces::automatic;
};
void declare(stage::ParameterList& list, TrackParameters& parameters);

/// What is wrong with a bead's track.
enum class TrackFlag { none, no_partner, ambiguous, neighbours_disagree, edge, saturated };
constexpr auto words(TrackFlag) {
  return std::array{"", "no partner", "ambiguous", "neighbours disagree", "edge", "saturated"};
}

/// A bead in one image; pixels, 0 at the centre of the first pixel.
struct DetectedBead {
  Vec2 position_px;
  double brightness = 0;  ///< height of the fitted spot above its surroundings, in the image's units
};

/// Bright spots of the image's own bead size, found to a fraction of a pixel.
///
/// The bead size is measured from the image's autocorrelation, the threshold from its noise; a Gaussian of that size
/// is fitted to each local maximum with its neighbours' spots taken away.
std::vector<DetectedBead> detect_beads(const images::Image& image,
                                       double detection_snr = TrackParameters{}.detection_snr, int threads = 1);

/// What all beads do together beside the cell's pull, with standard errors. The drift is taken off the field; turn,
/// growth and shear as `drift_affine` says.
struct CommonMotion {
  Vec2 drift_um;  ///< of the stressed image's centre
  double drift_sigma_um = 0;
  double turn_rad = 0;  ///< of the stressed image, from +x towards +y
  double turn_sigma_rad = 0;
  double growth = 0;  ///< relative
  double growth_sigma = 0;
  double shear = 0;            ///< longer by so much along its direction, shorter across it
  double shear_angle_rad = 0;  ///< from +x towards +y
  double shear_sigma = 0;
  bool has_far_field = false;  ///< some part of the picture is at rest; otherwise all are those of all beads alike
  double share_at_rest = 0;    ///< of the picture
  double share_of_border_moving = 0;
  bool is_affine = false;             ///< turn, growth and shear are there, taken off or not
  double share_of_border_pulled = 0;  ///< by a quarter of the largest displacement: there a cell is cut
  double pull_of_border = 0;          ///< largest motion along the border over the largest anywhere
};

/// How large and how round the beads' images are (measure.h).
struct BeadSizes {
  double ratio = 1;             ///< of their size in the stressed image over that in the relaxed one
  double sigma = 0;             ///< its standard error; 0: not known
  double elongation = 1;        ///< length over width, mean of both images
  double elongation_sigma = 0;  ///< its standard error; 0: not known
  double angle_rad = 0;         ///< of their length, from +x towards +y
  /// The same in both images, along rows or columns: as pixels that are not square make it, and lenses seldom.
  bool is_of_pixels = false;
};

/// How much of one picture's light shines in the other one, as where a camera keeps an image or frames were averaged.
struct Ghosts {
  double share = 0;        ///< of a bead's height; the larger of both pictures'
  double sigma = 0;        ///< its standard error; 0: not known, as where one picture is out of focus
  bool is_relaxed = true;  ///< the picture that shows the other's beads, too
};

struct Tracking {
  DisplacementField field;      ///< one entry for each bead found in the relaxed image, good or flagged
  Placement stressed;           ///< of the relaxed picture in the stressed one, if the gel were at rest
  CommonMotion common;          ///< what all beads do together
  double far_field_rms_um = 0;  ///< of a displacement component at rest, less drift and the cell's tail
  double noise_um = 0;          ///< the same as robust standard deviation
  double bead_sigma_um = 0;     ///< of a bead's picture
  double scatter_um = 0;  ///< of single beads about their neighbours, beyond the registration's error; in each sigma
  BeadSizes sizes{};
  Ghosts ghosts{};
  int n_good = 0;
  Effect affine{};              ///< whether turn, growth and shear were taken off, and why
  Effect windows{};             ///< whether windows were followed in place of single beads, and why
  double window_um = 0;         ///< Gaussian sigma of the windows; 0: single beads
  double period_um = 0;         ///< of a pattern that repeats itself, as of dots in a lattice; 0: it does not
  int n_windows = 0;            ///< among the field's entries, the last ones: in gaps between the beads
  double share_of_gaps = 0;     ///< of the picture, where single beads cannot be followed
  int n_beads_stressed = 0;     ///< found in the stressed image
  DisplacementField lattice{};  ///< windows all over the picture, beside the field, if asked for
};

/// The beads, or the texture, of one image are not met with again in the other.
struct NotFollowed : InvalidData {
  using InvalidData::InvalidData;
  /// The parameters that help, as was tried out; empty: none of them does. Unset: none was tried.
  std::optional<std::string> remedy = {};
};

/// The two images seem to be exchanged.
struct ExchangedImages : InvalidData {
  using InvalidData::InvalidData;
};

/// What the good beads show of the motion of all (um), a common motion beside: as of a gel that is pulled at known
/// places.
using FieldModel = std::function<std::vector<Vec2>(const DisplacementField& beads)>;

struct Side;
struct Texture;
class Gaps;

/// The beads, and the texture, of the relaxed image, found once for any number of stressed ones.
class RelaxedBeads {
 public:
  /// Where no beads stand out, windows are followed if they are asked for and not by themselves: they would follow the
  /// pattern of a camera's pixels, too, which never moves.
  /// @param model  of the gel, for step 5 below; none: that is left out
  /// @throws NotFollowed where the image shows no beads
  RelaxedBeads(const images::Image& relaxed, const TrackParameters& parameters, int threads, FieldModel model = {});

  /// Displacement of each bead of the relaxed image.
  ///
  /// 1. Windows of both images are cross-correlated on a grid, coarse to fine (drift: phase correlation; before that,
  ///    where `drift_affine` asks for it, the stressed image is turned back).
  /// 2. Around each bead the stressed image is registered to the relaxed one by an affine map with free gain and offset
  ///    (inverse-compositional Gauss–Newton: Baker & Matthews, IJCV 56:221, 2004), from the grid's prediction, and,
  ///    where that fails, from that of the beads already tracked nearby or from the stressed image's beads there; then
  ///    once more in a window of the bead's own size, which no neighbour and no steepness spoils.
  /// 3. Each is registered backwards, compared with its neighbours (Westerweel & Scarano, Exp Fluids 39:1096, 2005) and
  ///    flagged where it fails: `no partner`, `ambiguous` (does not come back, goes where another bead goes), `edge`,
  ///    `neighbours disagree`.
  /// 4. Where beads are loose, those that no window found are matched by pattern, light and neighbours (measure.h).
  /// 5. With a model of the gel, beads are compared in what they do beside it: those that contradict their neighbours
  ///    then are flagged, and step 4 is done once more. Where the pull is strong, a bead's neighbours move otherwise.
  /// 6. What the beads around predict is weighed in by how well such predictions hold there (measure.h).
  ///
  /// Where beads are dimmer than for 0.02 px, errors are correlated over some bead distances.
  ///
  /// By correlation, steps 1 to 3 are those of windows on a lattice in place of beads (windows.h): the smallest whose
  /// standard error is a tenth of a pixel. Nothing is weighed in. With `auto` such windows fill the gaps between the
  /// beads, too (follow.h).
  /// Places at rest are the beads' places in the relaxed picture, moved as the stage moved (`cell_with`).
  /// @param cell  the relaxed picture in the cell's pictures, if these are with another frame of the series
  /// @throws NotFollowed where the stressed image shows no beads, or others than the relaxed one
  /// @throws InvalidData where the sizes differ, or a turn is found and must not be taken off
  /// @throws ExchangedImages where the gel is pushed outward as if the images were exchanged (given_field.h)
  Tracking track(const images::Image& stressed, double pixel_size_um, const Progress& progress = {},
                 const std::optional<Placement>& cell = std::nullopt) const;

 private:
  /// A stressed image, and what is known of it beforehand.
  struct Stressed {
    const images::Image& image;
    double pixel_size_um;
    const std::optional<Placement>& cell;
    const Progress& progress;
  };
  Tracking track_by_any(const Stressed& stressed) const;
  Tracking track_by(TrackMethod method, const Stressed& stressed) const;
  Tracking track_as(TrackMethod method, Switch setting, const Stressed& stressed) const;
  void fill(const Gaps& gaps, const images::Image& unturned, const Placement& cell, double pixel_size_um,
            Tracking& tracking) const;
  DisplacementField lattice_of(const images::Image& unturned, const Placement& own, const Placement& cell,
                               double pixel_size_um) const;
  std::string remedy(const Stressed& stressed) const;
  images::Image relaxed_;
  std::shared_ptr<const Side> side_;        ///< unless windows alone are asked for
  std::shared_ptr<const Texture> texture_;  ///< unless beads alone are
  TrackParameters parameters_;
  int threads_;
  FieldModel model_;
};

/// Both at once.
Tracking track_beads(const images::Image& relaxed, const images::Image& stressed, double pixel_size_um,
                     const TrackParameters& parameters = {}, const Work& work = {});

}  // namespace mbtfm::beads
