/// A sheet on springs: small strains in one solve, large ones by Newton's method.
#pragma once

#include "continuum/sheet/large_strain.h"

namespace mbtfm::sheet {

/// u of a sheet on springs, small strains. @throws NotSolved where nothing holds the sheet
NodeVectors on_springs(const Elements& elements, const Sheet& sheet, int threads);

/// The same at large strains; springs per area at rest. @throws as in_load_steps
LargeStrain on_springs_large(const Elements& elements, const Sheet& sheet, ContractionMeasure measure, int threads);

}  // namespace mbtfm::sheet
