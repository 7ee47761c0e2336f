/// Numbers by name, for tables and VTK files.
#pragma once

#include <functional>
#include <string>
#include <type_traits>
#include <vector>

#include "pipeline/contract/geometry.h"

namespace mbtfm::files {

/// A named array over the points or cells of a VTK file or the rows of a table, some numbers each; the name carries the
/// unit.
struct NamedArray {
  std::string name;
  int components = 1;
  std::vector<double> values = {};
};

/// @param value  of each thing: a number, an array or a vector; one in the plane gets a z of 0, as ParaView draws
/// arrows of vectors in space only
template <class Things, class Value = std::identity>
NamedArray array_of(std::string name, const Things& things, Value value = {}) {
  NamedArray array{.name = std::move(name)};
  const auto add = [&](const auto& numbers) {
    array.components = static_cast<int>(std::size(numbers));
    array.values.insert(array.values.end(), std::begin(numbers), std::end(numbers));
  };
  for (const auto& thing : things) {
    const auto& of = std::invoke(value, thing);
    using Of = std::remove_cvref_t<decltype(of)>;
    if constexpr (std::is_same_v<Of, Vec2>) {
      add(std::initializer_list<double>{of.x, of.y, 0});
    } else if constexpr (std::is_same_v<Of, Vec3>) {
      add(std::initializer_list<double>{of.x, of.y, of.z});
    } else if constexpr (std::is_arithmetic_v<Of>) {
      array.values.push_back(of);
    } else {
      add(of);
    }
  }
  return array;
}

}  // namespace mbtfm::files
