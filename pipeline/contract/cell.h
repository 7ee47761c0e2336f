/// The data that flows between stages are plain structs; `check` states what must hold and is called by every reader
/// and writer. Units: um, nN, kPa, rad. Here: a segmented cell.
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pipeline/contract/geometry.h"
#include "pipeline/contract/words.h"

namespace mbtfm {

/// Where an adhesion comes from: found in an image or a mask of one; drawn by hand; put where a fibre drawn by hand
/// must be held and no adhesion is; put where one may be, because nothing shows the adhesions; or put where the beads
/// show a force away from all others.
enum class AdhesionOrigin { image, drawn, anchor, candidate, beads };
constexpr auto words(AdhesionOrigin) { return std::array{"image", "drawn", "anchor", "candidate", "beads"}; }
/// Nobody has seen it: it is an anchor or a candidate.
inline bool is_assumed(AdhesionOrigin origin) {
  return origin == AdhesionOrigin::anchor || origin == AdhesionOrigin::candidate;
}

/// A segmented focal adhesion: the ellipse of equal second moments, scaled to the area of the segmented component.
struct Adhesion {
  int adhesion_id = 0;  ///< stable label, >= 1
  Vec2 position_um;
  double area_um2 = 0;
  double major_axis_um = 0;  ///< full axes, not semi-axes
  double minor_axis_um = 0;
  double angle_rad = 0;  ///< of the major axis, from +x towards +y
  double eccentricity = 0;
  double mean_intensity = 0;
  AdhesionOrigin origin = AdhesionOrigin::image;
  std::optional<double> edge_distance_um{};  ///< from the centre to the outline, holes included; none: not stated
  std::optional<double> probability{};       ///< that it is an adhesion, by the image; none: not known
};
/// A candidate of a hexagonal lattice represents its cell, which is larger than the disc drawn into it; any other
/// adhesion for its own area.
double area_stood_for_um2(const Adhesion& adhesion);

/// Hotulainen & Lappalainen (2006): dorsal fibres end on an adhesion with one end, arcs with none, ventral with both.
/// An edge fibre is held at both ends, too, and runs along a free piece of the outline. Unclassified: the
/// type that its ends show is less probable than not.
enum class FibreType { dorsal, arc, ventral, edge, unclassified };
constexpr auto words(FibreType) { return std::array{"dorsal", "arc", "ventral", "edge", "unclassified"}; }
/// The first of its name, for labels: types are distinct without colour, too.
constexpr char letter_of(FibreType type) { return name_of(type)[0]; }
inline constexpr FibreType kFibreTypes[] = {FibreType::dorsal, FibreType::arc, FibreType::ventral, FibreType::edge,
                                            FibreType::unclassified};
/// How many of its ends the type says are held; of an unclassified fibre: may be.
int n_held_ends(FibreType type);

struct Fibre {
  int fibre_id = 0;  ///< stable label, >= 1
  FibreType type = FibreType::arc;
  double width_um = 0;
  std::optional<int> start_adhesion_id;  ///< the adhesion that holds points_um.front()
  std::optional<int> end_adhesion_id;    ///< the adhesion that holds points_um.back()
  double mean_intensity = 0;
  double confidence = 1;       ///< that it is a fibre, 0 to 1
  Polyline points_um;          ///< at least two, no two in a row equal
  double type_confidence = 1;  ///< chance of the type that its ends show, 0 to 1
  std::string type_reason{};   ///< in words; empty: none given
};

/// A segmented cell.
struct Cell {
  std::vector<Adhesion> adhesions;
  std::vector<Fibre> fibres = {};
  Polygon outline_um;
  std::vector<Polygon> holes_um;  ///< gaps in the cell, inside the outline
  /// By piece of the outline, from its point to the next: it is a cut, along the image's border, and the cell goes on
  /// beyond. Empty: none is.
  std::vector<bool> is_cut{};
  std::vector<Polygon> neighbours_um{};  ///< outlines of the other cells in the image, which pull at the same gel
};
/// Of the outline's pieces that are cuts: their ends.
using Cuts = std::vector<std::pair<Vec2, Vec2>>;
Cuts cuts_of(const Cell& cell);
double distance_to_cut_um(const Cell& cell, Vec2 point);
/// To the nearest ring of the outline, of a hole as of the cell.
double distance_to_edge_um(const Cell& cell, Vec2 point);

/// The ellipse of an adhesion, each axis grown by the margin on either side, as a polygon.
Polygon ellipse_corners(const Adhesion& adhesion, int n_corners, double margin_um = 0);
/// Whether the point lies in that ellipse.
bool covers(const Adhesion& adhesion, Vec2 point_um, double margin_um = 0);

/// State what must hold of a value. @throws InvalidData naming the element and the finding.
void check(const std::vector<Adhesion>& adhesions);
void check(const std::vector<Fibre>& fibres);
void check(const Cell& cell);

}  // namespace mbtfm
