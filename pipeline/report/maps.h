/// The report's maps of a cell: x to the right, y down, both in um. Those of a cell in space are seen from above.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/report/map_parts.h"

namespace mbtfm::report {

struct CellResults;
struct SpaceResults;

/// A map and what must be known to read it.
struct Figure {
  charts::Chart chart;
  std::string caption;
  std::string legend;  ///< HTML
};
std::string html_of(const Figure& map);

/// Outline, adhesions and fibres over the images that they were found in, where there are any.
Figure segmentation_map(const CellResults& results);
/// Both bead images on each other: around the strongest adhesion, in turn; whole, with the beads that were left out.
/// Only if results.bead_images is known.
std::vector<Figure> bead_maps(const CellResults& results);
/// Ellipses coloured by traction, with the force on the substrate as arrows.
Figure adhesion_map(const CellResults& results);
/// Tractions of the usual method in the colours of the adhesion map; only if results.usual_method has tractions.
Figure usual_method_map(const CellResults& results);
/// Measured displacement, and where results.residual is known also the fitted one and the difference: means over the
/// beads of small squares, drawn to one scale.
std::vector<Figure> displacement_maps(const CellResults& results);
/// Before it contracts, and in equilibrium.
Figure network_map(const CellResults& results);
Figure contracted_network_map(const CellResults& results);

// Of a cell whose beads are in space.

/// Tractions along the normal: out of the gel red, into it blue, nothing white.
Figure normal_map(const SpaceResults& results);
/// Along the surface, with arrows of its part in x and y.
Figure tangential_map(const SpaceResults& results);
/// Standard error of the traction, root mean square of the three components; none where it is not known.
std::optional<Figure> error_map(const SpaceResults& results);
/// How far apart two forces must be; none where it is not known.
std::optional<Figure> resolution_map(const SpaceResults& results);
/// Beads near a vertical plane through the strongest traction, along x and along y, with their displacement.
std::vector<Figure> bead_slices(const SpaceResults& results);

/// Of the tractions' sizes.
ColourScale traction_colours(const SpaceResults& results);
/// The surface from a side and above, coloured by the size of the traction, with tractions as arrows: an SVG element.
/// Orthographic; the nearest parts are drawn last (the painter's order). No light: colours are those of the bar.
std::string picture_in_space(const SpaceResults& results, const ColourScale& colours);

}  // namespace mbtfm::report
