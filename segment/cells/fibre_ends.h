/// Which adhesions hold a fibre, and what type that makes it.
#pragma once

#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"
#include "segment/cells/fibre_probability.h"

namespace mbtfm::cells {

/// The way on beyond an end, where a fibre may go on too faintly to be traced.
struct WayOn {
  Polyline points_um;              ///< from the end outwards
  std::vector<double> over_noise;  ///< by point, the ridge's height in standard deviations of the texture
  double beyond = 0;               ///< mean of the same in the image without the fibres
  double goes_on = 0;              ///< probability that another line is the same fibre's next piece
};

struct TracedFibre {
  Fibre fibre;          ///< without type and label
  WayOn before, after;  ///< its first point, its last
  FibreEvidence evidence{};
};

/// An end that reaches no adhesion is led on along its way to the first one there, if the way is brighter than texture
/// up to it: near an adhesion a fibre thins out, and other fibres hide it.
void lead_on(TracedFibre& traced, const std::vector<Adhesion>& adhesions, const Polygon& outline_um, double reach_um);

/// Which ends may be tied.
struct EndsToTie {
  bool start = true, end = true;
};

/// Does it run along the outline, for most of its length, where that is straight or bent inwards? A bundle along a free
/// edge spans between adhesions at its ends and draws the edge in (Bischofs et al., Biophys J 95:3488, 2008).
bool runs_along_free_edge(const Polyline& line, const Polygon& outline_um);

/// Where nobody sees adhesions: which ends something holds, by the shape of the fibre in the cell (Hotulainen &
/// Lappalainen 2006; docs/theory/segmentation.md). An arc runs along the cell's edge behind the lamellipodium and
/// bulges towards it: held nowhere. A dorsal fibre rises from an adhesion near the edge straight towards the cell's
/// middle, and is free there. Any other is taken for ventral, held at both ends, as are fibres that span the cell.
/// @param outline_um  not empty
/// @param band_um  from the edge inwards, where the adhesions are
EndsToTie ends_held_by_shape(const Polyline& line, const Polygon& outline_um, double band_um, double lamellipodium_um);

/// Tie each end to the adhesion it reaches: on the line's own course, at most `reach_um` ahead of the end or half of it
/// aside; the nearest. A tied end is led to the adhesion's centre. Both ends never share an adhesion; the nearer one
/// has it.
///
/// Where an end stops about as short of an adhesion as the reach, its direction decides: adhesions hold fibres that
/// run across the nearest edge of the cell, arcs run along it, so the reach is longer for the former and shorter for
/// the latter. Sets the type by the number of tied ends (Hotulainen & Lappalainen 2006), the chance that it is right,
/// and the reason in words.
/// @param outline_um  of the cell; empty: direction says nothing
/// @param ends  the others stay as they are drawn, free
void tie_ends(Fibre& fibre, const std::vector<Adhesion>& adhesions, const Polygon& outline_um, double reach_um,
              EndsToTie ends = {});

/// A dorsal fibre's free end may be where a ventral one was lost, and its type is as probable as the end is real: by
/// its depth in the cell, the line's brightness, darkness beyond it, and whether another line goes on. Logistic
/// regression on simulated cells (notes/dense_fibres.md).
void weigh_free_end(TracedFibre& traced, const Polygon& outline_um);

/// A fibre that leaves the image: a free end that points at a cut of the outline from at most `reach_um` away is led to
/// it. Whether an adhesion holds the fibre out there nobody sees, so its type is as likely wrong as right.
void lead_to_cut(Fibre& fibre, const Cuts& cuts, double reach_um);
/// Where lead_to_cut() leads.
bool is_on_cut(Vec2 end, const Cuts& cuts);

struct FarEnds {
  double anchor_area_um2 = 1;
  double lamellipodium_um = 3;  ///< arcs lie behind it
};

/// Fibres that span the cell, and bundles along a free edge, are held at both ends: where only one of them reaches an
/// adhesion, an anchor is put at the other one; ends that meet share it. Where neither does, anchors are put at both
/// ends of a fibre that spans the cell, unless it has the shape of an arc. Not where a fibre leaves the image.
/// @param adhesions  the anchors are added to them, with ids after the largest
void hold_far_ends(std::vector<Fibre>& fibres, std::vector<Adhesion>& adhesions, const Polygon& outline_um,
                   const Cuts& cuts, const FarEnds& p);

}  // namespace mbtfm::cells
