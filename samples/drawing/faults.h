/// What goes wrong with pictures in laboratories, besides noise.
#pragma once

#include <cstdint>

#include "pipeline/contract/cell.h"
#include "pipeline/stage/parameters_fwd.h"
#include "samples/drawing/raster.h"

namespace mbtfm::drawing {

struct FaultParameters {
  int n_specks = 0;              ///< of dye, in one or the other picture of the cell, beside it
  double speck_brightness = 20;  ///< over that of adhesions
  int n_dead_cells = 0;          ///< round, bright and at rest
  double relaxed_defocus = 1;    ///< of the beads' width
  double stressed_defocus = 1;
  double light_lost = 0;  ///< of the beads, before the later picture
  double saturated = 0;   ///< share of the pixels of the cell's pictures at the end of the detector's range
  int padding_px = 0;     ///< strip without data at the left and upper border of the cell's pictures
  int scale_bar_px = 0;   ///< length of a bar drawn into the cell's pictures; 0: none
  int n_hot_pixels = 0;   ///< of the camera: the same in all pictures
};
void declare(stage::ParameterList& list, FaultParameters& parameters);

/// Specks and dead cells, into the fluorophore of both pictures of the cell.
void add_debris(const Cell& cell, const FaultParameters& faults, std::uint64_t seed, images::Image& paxillin,
                images::Image& actin);

/// Hot pixels, into the counts of any picture.
void add_hot_pixels(int n_hot_pixels, std::uint64_t seed, images::Image& counts);

/// The end of the range, padding and bar, into the counts of a picture of the cell.
void spoil(const FaultParameters& faults, images::Image& counts);

}  // namespace mbtfm::drawing
