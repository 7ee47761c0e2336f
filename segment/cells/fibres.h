/// Stress fibres of an actin image.
#pragma once

#include <vector>

#include "pipeline/contract/cell.h"
#include "pipeline/contract/geometry.h"
#include "pipeline/stage/parameters_fwd.h"
#include "segment/cells/fibre_ends.h"
#include "segment/images/image.h"

namespace mbtfm::cells {

struct FibreParameters {
  double fibre_width_um = 0.6;           ///< typical bundle seen through a microscope; half to twice of it is found
  double fibre_averaging_um = 0.7;       ///< along the fibre: straight over this length, long enough to beat noise
  double fibre_start_noise = 3;          ///< faint fibres begin there; their whole length decides what they are
  double fibre_follow_noise = 2;         ///< once begun a fibre may fade into the noise
  double fibre_least_probability = 0.5;  ///< so the fewest lines are wrongly taken or left out
  double fibre_faintest = 0.25;          ///< fainter lines are filaments of the mesh, beside what the fibres carry
  double fibre_smallest_radius_um = 6;   ///< of curvature: bundles under tension are straight or gently curved
  double fibre_gap_um = 1.5;             ///< a bundle may be hidden by a crossing one for this long
  double fibre_shortest_um = 3;          ///< shorter lines look like texture
  double fibre_edge_um = 1.0;            ///< a line along the outline this near to it is the cortex of the edge
  double fibre_lamellipodium_um = 3;     ///< its width: this near to the edge a line that winds is a ruffle
  double fibre_reach_um = 1.0;           ///< an end this near to an adhesion's rim is held by it
  double fibre_faint_um = 4;             ///< longest faint end of the fibres that experts drew on a real cell
};

void declare(stage::ParameterList& list, FibreParameters& parameters);

struct TracedLines {
  std::vector<TracedFibre> fibres;
  std::vector<TracedFibre> rest;  ///< lines that are hardly fibres: less probable than `fibre_least_probability`
  /// By line the points, in no order, of actin as bright as the fibres that is in none of them; away from the cell's
  /// edge
  std::vector<Polyline> unexplained_um;
};

/// Lines of an actin image that are stress fibres, not yet tied to adhesions.
/// @param outline_um  lines whose middle lies outside are no fibres; empty: anywhere
/// @param pixel_size_um  > 0
/// @throws InvalidData where a pixel is not finite
TracedLines trace_fibres(const images::Image& image, const Polygon& outline_um, double pixel_size_um,
                         const FibreParameters& parameters);
/// Tie their ends, which gives the types; label them from 1, the longest first. Those that end up too short are left
/// out. A tied end lies at its adhesion's centre. `width_um` is the full width at half maximum of the mean profile,
/// `mean_intensity` the mean height above both sides in grey levels.
/// @param cuts  of the outline: see lead_to_cut()
std::vector<Fibre> tied(std::vector<TracedFibre> traced, const std::vector<Adhesion>& adhesions,
                        const Polygon& outline_um, const FibreParameters& parameters, const Cuts& cuts = {});

}  // namespace mbtfm::cells
