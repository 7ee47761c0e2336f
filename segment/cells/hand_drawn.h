/// Outline, adhesions and fibres that a person has drawn in ImageJ.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "segment/cells/fibres.h"
#include "segment/cells/outline.h"
#include "segment/images/channels.h"
#include "segment/rois/roi.h"

namespace mbtfm::cells {

/// The selections of a file, and the name by which errors call it.
struct RoiSet {
  std::string name;
  std::vector<rois::Roi> rois;
};

/// What is drawn is used instead of the segmentation of that part.
struct LabelMask;
struct HandDrawn {
  std::optional<RoiSet> outline, adhesions, fibres;
  /// Of another program, or drawn with its brush. Where there are selections, too, these count.
  std::shared_ptr<const LabelMask> outline_mask{}, adhesion_mask{};
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

/// Without those that are there twice, as ImageJ's manager has them after a second click; ids from 1.
std::vector<Adhesion> each_once(const std::vector<Adhesion>& drawn);

/// Each area as the ellipse of equal second moments, scaled to the area; of polygons by Green's theorem, without a
/// raster. `mean_intensity` is the mean grey value of the pixels with their centre inside above the median of those
/// between 0.3 and 1 um around the ellipse; 0 without an image. Ids in the order of the set, from 1.
/// @throws InputError naming the selection that is no area, lies outside or has no area
std::vector<Adhesion> hand_drawn_adhesions(const RoiSet& set, const std::optional<images::Channel>& adhesion,
                                           const Field& field);

/// A line of a set as a fibre, not yet tied to adhesions.
struct DrawnLine {
  Fibre fibre;
  std::optional<FibreType>
      stated;         ///< its type, by name ("dorsal 3", "Edge-12", "arc_1") or group (1 to 4: dorsal to edge)
  std::string where;  ///< names it in errors
};
/// Width and intensity from the image across the line, else its stroke or the typical width.
/// @throws InputError naming the selection that is no line, lies outside, is shorter than a pixel or is named for two
/// types
std::vector<DrawnLine> drawn_lines(const RoiSet& set, const std::optional<images::Channel>& actin, const Field& field,
                                   const FibreParameters& parameters);

/// Ends that a line's type says are held: of a type that is not stated both, if they reach an adhesion.
std::vector<Vec2> held_ends_um(const DrawnLine& line);

struct HeldFibres {
  std::vector<Fibre> fibres;
  std::vector<Adhesion> anchors;  ///< ids after the adhesions' largest
};
/// Fibres held as their type says: ventral and edge ones at both ends; a dorsal one at the end that reaches an
/// adhesion, else, or where both do, at its start; an arc nowhere. Where no adhesion is in reach an anchor is made, but
/// for ends on a cut. Of a line whose type is not stated, or unclassified, the ends are tied to what they reach, which
/// makes its type in the first case.
/// @throws InputError naming the line whose end must be held and lies outside the cell, or that lies within an adhesion
HeldFibres hold_fibres(std::vector<DrawnLine> lines, const std::vector<Adhesion>& adhesions, const CellOutline& cell,
                       const FibreParameters& parameters, double anchor_area_um2, const Cuts& cuts = {});

}  // namespace mbtfm::cells
