/// Tables of a cell in space: 4_traction/.
#pragma once

#include "pipeline/contract/results_in_space.h"
#include "pipeline/files/columns.h"

namespace mbtfm::files {

Table<SurfaceTraction> surface_traction_table();
Table<PartForce> part_force_table();

}  // namespace mbtfm::files
