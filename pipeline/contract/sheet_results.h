/// What is found for a contracting sheet.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pipeline/contract/words.h"

namespace mbtfm {

/// What the beads are asked for.
enum class SheetQuantity {
  contraction,
  stiffness,
  line_tension,
  contraction_over_stiffness,
  adhesion_stiffness,
  penetration,  ///< √(stiffness / adhesion stiffness): how far into the sheet its edge is felt
  bundle_tension
};
constexpr auto words(SheetQuantity) {
  return std::array{"contraction_nN_per_um",      "stiffness_nN_per_um",           "line_tension_nN",
                    "contraction_over_stiffness", "adhesion_stiffness_nN_per_um3", "penetration_um",
                    "bundle_tension_nN"};
}
/// For people.
struct NameAndUnit {
  const char *name, *unit;  ///< the unit is empty for a number without one
};
NameAndUnit for_people(SheetQuantity quantity);

/// What each source adds to a standard error. In squares they add up to it; none: it was not asked for.
struct SheetErrorParts {
  std::optional<double> beads = {};      ///< noise of the displacements
  std::optional<double> motion = {};     ///< that all beads share: the precision lost by fitting it, too
  std::optional<double> model = {};      ///< what the misfit calls for beyond the beads' noise
  std::optional<double> variation = {};  ///< of the contraction over the sheet, which is taken for even
  std::optional<double> mesh = {};       ///< what is left of it once a finer one has corrected the fit
  std::optional<double> outline = {};    ///< its place
  std::optional<double> gel = {};        ///< modulus, thickness and Poisson's ratio, where their errors are stated
  std::optional<double> substrate = {};  ///< what the gel's model leaves out
};
/// The one list of the parts. @param visit  of name and part
template <class Visit>
void for_each_part(const SheetErrorParts& p, const Visit& visit) {
  visit("beads", p.beads);
  visit("motion", p.motion);
  visit("model", p.model);
  visit("variation", p.variation);
  visit("mesh", p.mesh);
  visit("outline", p.outline);
  visit("gel", p.gel);
  visit("substrate", p.substrate);
}

/// A row of sheet_fit.csv.
struct SheetEstimate {
  SheetQuantity quantity = SheetQuantity::contraction;
  std::string part = {};  ///< of the sheet, where it has parts with contractions of their own; or the bundle
  double value = 0;
  std::optional<double> sigma = {};           ///< standard error; none if the beads do not determine the quantity
  std::optional<double> low = {}, high = {};  ///< 95 %; none where the beads set no limit to that side
  bool identifiable = true;                   ///< limited to both sides
  SheetErrorParts parts = {};                 ///< of sigma
};
inline constexpr const char* kMeanPart = "mean";  ///< part of an estimate over a sheet whose contraction varies
inline constexpr const char* kWholeSheet = "sheet";
/// What the estimate is of, the same in all sheets: kWholeSheet; "edge", "inside"; "cell" or "fibre" of each that has
/// a label.
std::string kind_of_part(const SheetEstimate& estimate);
/// The user said what it is: the beads were not asked.
inline bool is_given(const SheetEstimate& e) { return e.low && e.high && *e.low == *e.high; }

/// What the stage sheet found for a cell or a colony.
struct SheetSummary {
  std::vector<SheetEstimate> estimates;
  double mean_tension_nN_per_um = 0;            ///< ½ tr S, mean over the area
  double total_force_nN = 0;                    ///< sum of force magnitudes over the sheet's triangles
  std::optional<double> strain_energy_fJ = {};  ///< of the gel; none: made by a version that did not give it
  double area_um2 = 0;
  double relative_l2 = 0;           ///< |u_measured − u_model| / |u_measured|
  double expected_relative_l2 = 0;  ///< what the bead noise alone would give
};

}  // namespace mbtfm
