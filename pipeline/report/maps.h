/// The report's maps of a cell, each one an <svg> element.
#pragma once

#include <string>

#include "pipeline/report/results.h"

namespace mbtfm::report {

/// A map and what must be known to read it.
struct Figure {
  std::string title, svg, caption;
};

/// Ellipses coloured by traction, with the force on the substrate as arrows.
Figure adhesion_map(const CellResults& results);
/// Arrows over the beads, thinned out evenly.
Figure displacement_map(const CellResults& results);
/// What the model leaves unexplained, averaged over neighbouring beads. Needs results.residual.
Figure residual_map(const CellResults& results);
enum class NetworkForm { original, contracted };
Figure network_map(const CellResults& results, NetworkForm form);

}  // namespace mbtfm::report
