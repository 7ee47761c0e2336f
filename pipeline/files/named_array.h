/// Numbers by name, for tables and VTK files.
#pragma once

#include <functional>
#include <string>
#include <type_traits>
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

/// @param value  of each thing: a number or a Vec2
template <class Things, class Value>
PointArray array_of(std::string name, const Things& things, Value value) {
  PointArray array{.name = std::move(name)};
  for (const auto& thing : things) {
    if constexpr (std::is_convertible_v<decltype(std::invoke(value, thing)), Vec2>) {
      array.vectors.push_back(std::invoke(value, thing));
    } else {
      array.scalars.push_back(std::invoke(value, thing));
    }
  }
  return array;
}

}  // namespace mbtfm::files
