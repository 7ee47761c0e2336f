/// Numbers by name, for tables and VTK files.
#pragma once

#include <string>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm::files {

/// A named array over the points or cells of a VTK file or the rows of a table, one value or (x, y) each; the name
/// carries the unit.
struct PointArray {
  std::string name;
  std::vector<double> scalars = {};
  std::vector<Vec2> vectors = {};
};

}  // namespace mbtfm::files
