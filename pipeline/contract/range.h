/// Intervals of allowed values.
#pragma once

#include <limits>
#include <string>
#include <string_view>

namespace mbtfm {

/// An interval of allowed values.
struct Range {
  double low = -std::numeric_limits<double>::infinity();
  double high = std::numeric_limits<double>::infinity();
  bool excludes_low = false;
  bool excludes_high = false;
  static Range any() { return {}; }
  static Range positive() { return {.low = 0, .excludes_low = true}; }
  static Range not_negative() { return {.low = 0}; }
  static Range between(double low, double high) { return {.low = low, .high = high}; }
  // What a quantity can be at all in a cell or its gel, with a margin of ten or more: a value beyond is a slip.
  static Range size_um() { return between(1e-3, 1000); }       ///< of a part of a cell: a molecule to ten cells
  static Range zero_or_size_um() { return between(0, 1000); }  ///< the same, or none
  static Range pixel_um() { return between(1e-3, 20); }        ///< 0.005 in an expanded gel to 6.5 without a lens
  static Range mesh_um() { return between(0.01, 100); }        ///< of a mesh, a lattice: a protein to a cell
  static Range area_um2() { return between(1e-6, 1e6); }       ///< (size_um)²
  static Range modulus_kPa() { return between(1e-3, 1e6); }    ///< mucus to hard plastic
  static Range thickness_um() { return between(0.1, 1e5); }    ///< of a gel: a coating to a block in the hand
  static Range force_nN() { return between(1e-6, 1e6); }       ///< a thousandth of a motor protein to many cells
  static Range factor() { return between(1e-6, 1e6); }         ///< of a ratio that must be there
  static Range zero_or_factor() { return between(0, 1e6); }    ///< of a ratio or a spread that may be none
};

bool is_inside(const Range& range, double value);
/// "a number > 0", for messages and the parameter page.
std::string describe(const std::string& noun, const Range& range);

/// "the unit is kPa: 8400 Pa is 8.4 kPa": if the value is outside the range as it is, and inside it in a unit a
/// thousand times smaller or larger. Empty where it is not. @param name  with its unit
std::string unit_slip(std::string_view name, double value, const Range& range);

}  // namespace mbtfm
