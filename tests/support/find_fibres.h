/// Fibres of an image, traced and tied in one step.
#pragma once

#include "segment/cells/fibres.h"

namespace mbtfm::cells {

inline std::vector<Fibre> find_fibres(const images::Image& image, const Polygon& outline_um,
                                      const std::vector<Adhesion>& adhesions, double pixel_um,
                                      const FibreParameters& p) {
  return tied(trace_fibres(image, outline_um, pixel_um, p).fibres, adhesions, outline_um, p);
}

}  // namespace mbtfm::cells
