#pragma once

#include <array>

namespace mbtfm::numerics {

/// How the numbers of the factor are kept. `single_`: 7 digits, of which the condition of the matrix takes its share;
/// half the memory, nearly twice the speed.
enum class Precision { single_, double_ };
constexpr auto words(Precision) { return std::array{"single", "double"}; }

}  // namespace mbtfm::numerics
