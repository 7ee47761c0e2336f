/// The report's maps of a cell: x to the right, y down, both in um.
#pragma once

#include <string>
#include <vector>

#include "pipeline/charts/chart.h"

namespace mbtfm::report {

struct CellResults;

/// A map and what must be known to read it.
struct Figure {
  charts::Chart chart;
  std::string caption;
  std::string legend;  ///< HTML
};
std::string html_of(const Figure& map);

/// Outline, adhesions and fibres over the images that they were found in, where there are any.
Figure segmentation_map(const CellResults& results);
/// Both bead images on each other, with the beads that were left out; only where results.bead_images is known.
Figure bead_map(const CellResults& results);
/// Ellipses coloured by traction, with the force on the substrate as arrows.
Figure adhesion_map(const CellResults& results);
/// Tractions of the usual method in the colours of the adhesion map; only if results.usual_method has tractions.
Figure usual_method_map(const CellResults& results);
/// Measured displacement, and where results.residual is known also the fitted one and the difference: means over the
/// beads of small squares, drawn to one scale.
std::vector<Figure> displacement_maps(const CellResults& results);
enum class NetworkForm { original, contracted };
Figure network_map(const CellResults& results, NetworkForm form);

}  // namespace mbtfm::report
