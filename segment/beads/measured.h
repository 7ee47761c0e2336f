/// Inside of the bead tracker: the motion of each bead, or window, of one stressed image.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "segment/beads/far_field.h"
#include "segment/beads/follow.h"
#include "segment/beads/measure.h"
#include "segment/beads/windows.h"

namespace mbtfm::beads {

/// The motion of each place, px: of a bead, or of a window.
struct Measured {
  std::shared_ptr<const Scene> scene;
  std::vector<Track> tracks;
  Pooling pooling;
  BeadSizes sizes = {};
  double window_px = 0;  ///< Gaussian sigma of the windows; 0: beads
  double period_px = 0;  ///< of a pattern that repeats itself; 0: it does not
};

/// How a stressed image is followed. Members must outlive this.
struct Setting {
  const std::optional<Turn>& turn;  ///< by which it was turned back
  const TrackParameters& parameters;
  double pixel_size_um = 0;
  int threads = 1;
};

/// What moved the good beads together, px. @param motions  by bead. @param setting  as of drift_affine
MotionTaken motion_of_all(const Scene& scene, const std::vector<Track>& tracks, const std::vector<Vec2>& motions,
                          Switch setting, double tolerance);

/// Where a pixel lies, um: positions count from the centre of the first pixel.
inline Vec2 place_um(Vec2 position_px, double pixel_size_um) { return pixel_size_um * (position_px + Vec2{0.5, 0.5}); }

/// The relaxed picture in the cell's ones. @param own  the same in this stressed picture
Placement placement_of_cell(const TrackParameters& parameters, const std::optional<Placement>& cell,
                            const Placement& own);

/// Of the model of the gel, which is in the frame of the cell's pictures.
struct PlacedModel {
  const FieldModel& um;
  const std::optional<Placement>& cell;  ///< if it is known before the beads are followed
};

Measured measured_beads(const std::shared_ptr<const Side>& relaxed, const images::Image& image,
                        const images::Image& stressed, const Setting& as, const PlacedModel& model);

/// What a size of window gives.
struct Tried {
  Measured measured;
  int n_by_grid = 0;
  bool is_sound = false;  ///< two windows in three are found again, and their errors are known
  double median_sigma_px = 0;
  double knowledge = 0;  ///< sum of 1/sigma²
};

/// @param gaps  whose windows alone count; none: all do
/// @param spacing_px  of the windows; 0: as far as they do not overlap
Tried tried_windows(const Texture& relaxed, const Texture& stressed, double window_px, const Setting& as,
                    const Gaps* gaps = nullptr, double spacing_px = 0);

/// In the smallest windows that are fine enough; where none are, in those that know most together.
Measured measured_windows(const Texture& relaxed, const images::Image& stressed, const Setting& as,
                          const Gaps* gaps = nullptr);

}  // namespace mbtfm::beads
