/// How the actin image lies on the adhesion image, and whether that one shows actin, too. Filters and cameras put them
/// some pixels off each other, and let a part of one dye's light through to the other's image.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"
#include "segment/images/image.h"

namespace mbtfm::cells {

/// Where the adhesion image shows what the actin image shows elsewhere: shifted, turned and grown about a centre.
struct ChannelAlignment {
  Vec2 centre_um, shift_um;
  double turn_rad = 0;  ///< from +x towards +y
  double growth = 0;    ///< relative
  Vec2 shift_sigma_um;  ///< standard errors
  double turn_sigma_rad = 0, growth_sigma = 0;
  /// Twice the gain of the log likelihood over images that lie on each other.
  double gain = 0;
  Vec2 of(Vec2 actin_um) const;
  /// More than chance makes of images that lie on each other.
  bool is_significant() const;
};

/// A fibre pulls its adhesion along itself: the line on which it ends passes through the adhesion's centre. How far
/// aside each end's line passes its adhesion shows the shift across it, and ends of all directions show the whole.
///
/// Each end may belong to any adhesion near by, or to none: the likelihood of an offset d is
/// (1 − π) N(d; 0, w) + π/2R, with half of the ends to be strays, w a quarter of the adhesions' median minor axis and R
/// the range. It is maximised over shifts on a grid within `farthest_um`, then over shift, turn and growth by
/// Gauss–Newton. Errors: sandwich estimate.
/// @param fibres  not tied to adhesions yet, at least two points each
/// @return nothing where fewer than ten ends have an adhesion near by, or where they all point the same way
std::optional<ChannelAlignment> align_channels(const std::vector<Fibre>& fibres, const std::vector<Adhesion>& adhesions,
                                               double farthest_um = 1.2);

/// "(0.31, -0.12) +- (0.02, 0.02) um, turned by ... degrees, grown by ... %"
std::string sentence_of(const ChannelAlignment& alignment);

/// Contrast of the cell's fibres in the adhesion image, over that of its adhesions. A contrast is the brightness on an
/// object less the mean of both sides of it, 0.5 um beyond its width; of adhesions their middle one, across their minor
/// axis; of fibres the middle one of all their points, a fifth of a micrometre apart, but for 3 um at each end.
/// @returns nothing of a cell without adhesions, or with less than 10 um of such fibre
std::optional<double> contrast_of_fibres(const images::Image& adhesion, const Cell& cell, double pixel_um);

}  // namespace mbtfm::cells
