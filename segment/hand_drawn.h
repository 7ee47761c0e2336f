/// Outline, adhesions and fibres that a person has drawn in ImageJ.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "segment/channels.h"
#include "segment/fibres.h"
#include "segment/outline.h"
#include "segment/roi.h"

namespace mbtfm::segment {

/// The selections of a file, and the name by which errors call it.
struct RoiSet {
  std::string name;
  std::vector<Roi> rois;
};

/// What is drawn is used instead of the segmentation of that part.
struct HandDrawn {
  std::optional<RoiSet> outline, adhesions, fibres;
};

/// The field in which they must lie.
struct Field {
  int width_px = 0;
  int height_px = 0;
  double pixel_um = 0;
};

/// The set's largest area, and as holes the others, which lie within it: paths of one composite selection or selections
/// of their own. @throws InputError where one lies beside it, is no area, lies outside the field or has no area
CellOutline hand_drawn_outline(const RoiSet& set, const Field& field);

/// Each area as the ellipse of equal second moments, scaled to the area; of polygons by Green's theorem, without a
/// raster. `mean_intensity` is the mean grey value of the pixels with their centre inside above the median of those
/// between 0.3 and 1 um around the ellipse; 0 without an image. Ids in the order of the set, from 1.
/// @throws InputError naming the selection that is no area, lies outside or has no area
std::vector<Adhesion> hand_drawn_adhesions(const RoiSet& set, const std::optional<Channel>& adhesion,
                                           const Field& field);

/// Each line as a fibre, its ends tied to the adhesions they reach. The type is that of its name ("dorsal 3",
/// "Ventral-12", "arc_1") or of its group (1 dorsal, 2 arc, 3 ventral), with certainty, else that of its ends. Width
/// and intensity from the image across the line, else its stroke or the typical width.
/// @throws InputError naming the selection that is no line, lies outside, is shorter than a pixel or is named for two
/// types
std::vector<Fibre> hand_drawn_fibres(const RoiSet& set, const std::vector<Adhesion>& adhesions,
                                     const Polygon& outline_um, const std::optional<Channel>& actin, const Field& field,
                                     const FibreParameters& parameters, const Cuts& cuts = {});

/// Area, centroid and the ellipse of equal second moments of a polygon, scaled to its area.
///
///   A = ½ Σ c_i,  ∫x² = 1/12 Σ c_i (x_i² + x_i x_j + x_j²),  ∫xy = 1/24 Σ c_i (x_i y_j + 2 x_i y_i + 2 x_j y_j + x_j
///   y_i)
///
/// with j = i + 1 and c_i = x_i y_j − x_j y_i (Green's theorem).
/// @param polygon  of an area other than 0
/// @throws InvalidData where it crosses itself so that it has no such ellipse
Adhesion ellipse_of_polygon(const Polygon& polygon);

}  // namespace mbtfm::segment
