/// Forces of others: beyond the cut of a cell that its image cuts, and beneath other cells in the image. Their
/// displacement reaches this cell's beads. It is allowed for as motions of the beads: responses of the gel to forces at
/// these places, which are not found one by one but expected to be of one size, which the beads determine.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "mbtfm/tensions/linear_data.h"
#include "pipeline/contract/cell.h"
#include "pipeline/contract/gel.h"
#include "pipeline/stage/effects.h"

namespace mbtfm::tensions {

/// How fine the places are. A finer choice of either changes the forces by less than a tenth of their standard errors
/// (`property/cut_cells`).
struct BeyondSpacing {
  /// Of the squares at the cut, in mean distances of the beads: what varies within less does not reach the second row
  /// of beads, as the field of a force pattern of wavelength p falls as exp(−2 pi x / p) into the image.
  double finest = 1;
  /// Side of a square over its distance from the cut: what varies within less than its distance has faded at the cut.
  double growth = 1;
};

/// Squares that tile the surface outside of the image round the cut, as discs of the same area. They reach as far as
/// the part of the cell that is seen is long, and no less than a spread cell (60 um): an image may show a small part.
/// @param finest_um  side of the smallest, > 0
std::vector<substrate::Ellipse> places_beyond(const Cell& cell, double finest_um, double growth);

/// Squares that tile the neighbours, as discs of the same area. A cell far away is seen by the low moments of its
/// forces only, and has few.
/// @param beads_um  that are used, none of them beside a neighbour
std::vector<substrate::Ellipse> places_beneath_neighbours(const Cell& cell, const std::vector<Vec2>& beads_um,
                                                          const BeyondSpacing& spacing);
/// Whether a bead measures a neighbour's forces more than this cell's: it is no witness of rest, either.
bool is_nearer_to_neighbour(const Cell& cell, Vec2 place_um);

/// What was allowed for.
struct ForcesBeyond {
  Index n_places = 0, n_beneath_neighbours = 0;
  Index n_motions = 0;  ///< of the beads, that exceed their noise
  /// Standard deviation of a component of the forces by square root of the area that they act on (nN/um); forces
  /// independent of each other over an area A have a sum of this times √A.
  double intensity_nN_per_um = 0;
  /// Adhesions so near to the cut that they may have forces besides the network's, and the standard deviation of a
  /// component of the adhesions' forces in this cell, of which these may have all next to the cut.
  Index n_own = 0;
  double own_nN = 0;
  std::vector<std::string> borders = {};  ///< of the beads' field, beyond which forces act: "upper left"
};

struct DataWithBeyond {
  LinearData data;
  ForcesBeyond beyond;
};
/// The data with these motions besides those that they have. The forces are taken for random, independent of each other
/// and of one intensity: the one that makes the data most likely, whatever the forces inside of the image are
/// (restricted maximum likelihood; Patterson & Thompson, Biometrika 58 (1971) 545), but no less than that of the forces
/// in view. An even traction of any size is allowed for besides them. What lies out there pulls the image's border
/// outwards or inwards as a growth would: growth and shears are from here on expected to be of usual size
/// (kUsualGrowth).
/// @param data  whose motions are affine_motions(), of precision 0, or none
/// @param n_beyond  of the places: the first ones, beyond a cut; forces beneath a neighbour balance, more or less, and
/// have no even traction
/// @param compliance_um_per_nN  2·beads × 2·places
/// @param area_um2  of the part of the cell that is in view
DataWithBeyond with_forces_beyond(LinearData data, const std::vector<substrate::Ellipse>& places, Index n_beyond,
                                  const MatrixXd& compliance_um_per_nN, double area_um2);
/// Adhesions near the cut may have forces of their own, besides the network's: a fibre of which less than 3 um is in
/// view is not segmented (segment.fibre_shortest_um) and may pull on them; and at the cut the network is held where it
/// is, while the cell's own gave way, which fades over 10 um. They pass through the cut. Expected is a part of the size
/// that adhesion forces of this cell have, as forces independent of each other show it.
/// @param cell  whose adhesions are those of the data
DataWithBeyond with_own_forces(DataWithBeyond given, const Cell& cell);
/// Both, for the places of this cell, on a layer of this gel (of gels with sides or a graded modulus it differs by
/// less than the intensity is known to).
DataWithBeyond with_forces_beyond(LinearData data, const Cell& cell, const Gel& gel, const BeyondSpacing& spacing = {});

/// Whether there are forces of others: a cut, or a neighbour.
bool has_forces_beyond(const Cell& cell);
/// @throws UsageError where it is switched on and there are none
bool allows_forces_beyond(const stage::EffectSwitches& switches, const Cell& cell);
/// @param found  none where it is off
Effect beyond_cut_effect(Switch setting, const Cell& cell, const std::optional<ForcesBeyond>& found);

}  // namespace mbtfm::tensions
