/// From the images of one cell to its segmentation.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"
#include "segment/cells/adhesions.h"
#include "segment/cells/candidates.h"
#include "segment/cells/channel_alignment.h"
#include "segment/cells/fibres.h"
#include "segment/cells/hand_drawn.h"
#include "segment/cells/mask.h"
#include "segment/cells/outline.h"
#include "segment/images/channels.h"

namespace mbtfm::cells {

struct SegmentParameters {
  std::optional<double> pixel_size_um;  ///< no default: it scales every force; the image's own calibration if unset
  int binning = 1;                      ///< to be quick: everything that is found becomes coarser with the pixels
  int cell = 1;                         ///< most images are of one cell
  images::PlaneChoice adhesion_plane, actin_plane;
  Switch align_channels = Switch::automatic;  ///< actin on adhesions
  std::string contact_sheet;                  ///< none: it takes a segmentation for each of its pictures
  AdhesionParameters adhesions;
  CandidateParameters candidates;
  FibreParameters fibres;
  OutlineParameters outline;
};

void declare(stage::ParameterList& list, SegmentParameters& parameters);

struct Segmentation {
  Cell cell;
  double pixel_size_um = 0;
  int n_cells = 1;                              ///< that the image shows
  double area_um2 = 0;                          ///< of the cell, less its holes
  std::optional<OutlineNeck> neck{};            ///< the cell was cut off another one there
  bool is_cut_by_border = false;                ///< the image ends before the cell does
  int n_adhesions_outside = 0;                  ///< found beyond the cell and left out
  std::vector<Polygon> left_out_um{};           ///< those, and then other things that are no part of the cell
  std::optional<double> adhesions_beyond{};     ///< see share_beyond_cells()
  double reach_um = 0;                          ///< of an outline that was found, beyond its adhesions
  std::optional<double> outline_off_actin{};    ///< share of a given outline's area beyond them
  std::optional<double> bleed_through{};        ///< contrast of the fibres over that of the adhesions, in their image
  std::optional<ChannelAlignment> alignment{};  ///< of the actin image on the adhesion image, if fibre ends show it
  std::vector<Polyline> unexplained_um{};       ///< actin as bright as the fibres that is in none of them
  std::vector<Polyline> doubtful_um{};          ///< lines that may be fibres and are less probable than these must be
  bool is_aligned = false;                      ///< fibres and outline were moved by it
  AdhesionSource source = AdhesionSource::image;
  std::optional<PatternAtCell> pattern{};  ///< where the cell sits on one: see pattern_at()
  int n_anchors = 0;                       ///< that hold ends of fibres where no adhesion is
  /// The cell with the candidates at other places, the same fibres tied to them; none where there is nothing to place.
  std::optional<Cell> second{};
  std::vector<std::string> unused{};  ///< inputs that others took the place of, a sentence each
};

/// Adhesions from the adhesion channel, fibres from actin, the outline from actin or, without it, from adhesions. What
/// is drawn by hand is used instead of each, or else a mask. Where nothing shows adhesions, or the parameters say so,
/// there are candidates for them instead (candidates.h). Without actin there are no fibres.
/// @returns the cell that the parameters name, or all of them, the largest first
/// @throws UsageError without any channel, where all cells are asked for and fibres are drawn by hand, or where the
/// source of the adhesions is not there
/// @throws InputError where sizes or calibrations contradict each other or none has the pixel size; where a channel
/// is constant or saturated; where no cell, fewer cells than asked for, or in a given adhesion channel no adhesion is
/// found
std::vector<Segmentation> segment_cells(const std::optional<images::Channel>& adhesion,
                                        const std::optional<images::Channel>& actin,
                                        const SegmentParameters& parameters, const HandDrawn& drawn = {});

/// The first of them.
Segmentation segment_cell(const std::optional<images::Channel>& adhesion, const std::optional<images::Channel>& actin,
                          const SegmentParameters& parameters, const HandDrawn& drawn = {});

}  // namespace mbtfm::cells
