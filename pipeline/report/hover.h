/// What one reads where the mouse rests on something.
#pragma once

#include <string>

#include "pipeline/contract/cell.h"

namespace mbtfm::report {

struct CellResults;

/// Id, type, tension with its 95 % interval, length, adhesions.
std::string hover_of(const Fibre& fibre, const CellResults& results);
/// Id, force with its standard error, traction, area, fibres that end on it.
std::string hover_of(const Adhesion& adhesion, const CellResults& results);

}  // namespace mbtfm::report
