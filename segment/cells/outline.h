/// The outlines of the cells.
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"
#include "pipeline/stage/parameters_fwd.h"
#include "segment/images/image.h"

namespace mbtfm::cells {

constexpr double kOutlineSpacing_um = 0.5;  ///< of the polygon's points

struct OutlineParameters {
  double outline_reach_um = 3;            ///< an adhesion up to this far outside is still this cell's
  double outline_smallest_um2 = 50;       ///< less is debris, not a spread cell
  double outline_largest_um2 = 30000;     ///< ten spread cells: more is a sheet of cells that touch
  double outline_smallest_hole_um2 = 10;  ///< less is a gap in the actin mesh, over which the membrane spans
  double outline_neck = 0.6;              ///< pairs that touch have 0.15 to 0.7, real cells that are alone from 0.85 on
};

void declare(stage::ParameterList& list, OutlineParameters& parameters);

/// Where the outline of a cell was cut off that of another one, which touches it.
struct OutlineNeck {
  Vec2 at_um;
  double width_um = 0;
};

/// A cell in the image: its outer ring and the gaps in it.
struct CellOutline {
  Polygon outer_um;
  std::vector<Polygon> holes_um;
  double area_um2 = 0;                ///< without the holes
  bool is_sheet = false;              ///< larger than any single cell; its holes are left out
  std::vector<bool> is_cut{};         ///< by piece of the outer ring: the image ends there before the cell does
  std::optional<OutlineNeck> neck{};  ///< the narrowest of those where it was cut off another cell
  bool is_cut_by_border() const { return std::ranges::find(is_cut, true) != is_cut.end(); }
};

/// A ring, and which of its pieces run along the image's border.
struct CutRing {
  Polygon points_um;
  std::vector<bool> is_cut;
};
/// A piece is cut where both its ends lie within `reach_um` of the same side of the image; they are put onto it. The
/// image's corner is put in where the ring goes round it that closely.
CutRing cut_by_border(const Polygon& ring_um, Vec2 field_um, double reach_um);

/// In the outer ring and in none of the holes.
bool is_in_cell(const CellOutline& cell, Vec2 point_um);

/// The cells that an image shows, the largest first.
struct CellsInImage {
  std::vector<CellOutline> cells;
  /// By adhesion that was given: distance of its centre from the nearest cell as the image itself shows it, before any
  /// adhesion is added; 0: in it.
  std::vector<double> beyond_um;
  std::vector<Polygon> debris_um = {};  ///< bright things beyond all cells that are smaller than one
};

/// The cells of an image. Cells that touch are cut apart at the neck between them (cell_mask.h); if there is none, they
/// count as one.
///
/// A first mask by Otsu's threshold of the smoothed image's logarithm above the darkest region; then each point near
/// the edge is put to the side, inside or outside, whose mean brightness nearby it resembles more (localised Chan–Vese,
/// Lankton & Tannenbaum 2008), which follows uneven light and background. Adhesions within the reach are added. Gaps
/// that are as dark as the surroundings are holes. At last each ring is moved to the edge in the unsmoothed image: see
/// cell_mask.h.
/// Where a cell reaches far beyond its adhesions (see reach_um), the threshold of the light within it is tried:
/// scattered light in the disc of the lamp stands out as a cell does, and the cell stands out of it. It counts where it
/// holds the adhesions and reaches no farther than cells do.
/// @returns none where there is no cell (constant or noise)
CellsInImage find_cells(const images::Image& image, const std::vector<Adhesion>& adhesions, double pixel_size_um,
                        const OutlineParameters& parameters);

/// Share of a cell's area that lies more than `far_um` beyond all of the others.
double share_beyond(const CellOutline& cell, const std::vector<CellOutline>& others, double far_um);

/// Of the adhesions in or near the cells that the image shows, and of those that follow them in steps of 8 um, the
/// share by area that lies beyond the cells: of a cell that is dim on one side, or of another picture. Nothing where
/// the image shows no cell.
std::optional<double> share_beyond_cells(const CellsInImage& seen, const std::vector<Adhesion>& adhesions);

/// A cell that spreads has adhesions along its edge: in eighteen simulated and fourteen real cells it reaches at
/// most 6.2 um beyond the convex hull of their centres, and 10 to 50 where the edge of a disc of light, the dark side
/// of the picture or its padding was taken for the cell's.
constexpr double kOutlineReach_um = 8;
/// How far a cell's outline, where the image's border does not cut it, reaches beyond the hull of its adhesions; 0
/// where they are less than three.
double reach_um(const CellOutline& cell, const std::vector<Adhesion>& adhesions);
double reach_um(const CellsInImage& seen, const std::vector<Adhesion>& adhesions);  ///< the largest of all cells

/// The adhesions whose centre lies in the cell, with their ids renewed.
std::vector<Adhesion> inside(const CellOutline& cell, const std::vector<Adhesion>& adhesions);
std::vector<Adhesion> inside(const Polygon& outline_um, const std::vector<Adhesion>& adhesions);

}  // namespace mbtfm::cells
