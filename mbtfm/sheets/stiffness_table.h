/// What a contracting sheet on a gel does to the gel, for any stiffness of the sheet and of its adhesions.
#pragma once

#include <memory>
#include <optional>
#include <vector>

#include "continuum/sheet/bundles.h"
#include "continuum/sheet/on_gel.h"
#include "pipeline/contract/gel.h"
#include "pipeline/numerics/dense.h"

namespace mbtfm::sheets {

/// Between sheet and gel.
enum class Bond {
  known,  ///< bonded, or springs of a given stiffness
  fitted  ///< springs of any stiffness
};

/// The sheet without its modulus and its contraction.
struct SheetShape {
  std::shared_ptr<const sheet::Elements> elements;
  /// At the points of the elements: an even one is 1. Several parts, each with a contraction of its own, add up to 1.
  std::vector<std::vector<double>> contractions;
  double poisson_ratio = 0.5;
  int n_rims = 1;
  bool has_line = false;                    ///< a line tension at the rims, too
  std::vector<sheet::Bundle> bundles = {};  ///< and one in each of these
  Bond bond = Bond::known;
  std::optional<double> adhesion_nN_per_um3 = {};  ///< of a known bond; unset: bonded
};

/// M = E h / (1 − nu²), and of the adhesions' springs; unset: bonded.
struct Stiffnesses {
  double sheet_nN_per_um = 0;
  std::optional<double> adhesion_nN_per_um3 = {};
};

struct StiffnessRange {
  double low = 0, high = 0;
};

/// Forces of the patches by a contraction of 1 nN/um of each part (and tensions of 1 nN of the line at the rims and of
/// each bundle, in this order), as a function of the
/// stiffnesses: reduced bases (Quarteroni, Manzoni & Negri, Reduced Basis Methods for Partial Differential Equations,
/// 2016). Solved at some stiffnesses; between, the forces are the sum of the solutions of all loads that balances best,
/// in the sense of energy. What they lack falls exponentially with their number, and its energy as the square of it.
class StiffnessTable {
 public:
  /// From where the sheet is so soft that its mesh resolves it no more to where it does not strain: M / (mu R) from
  /// 0.03 to 300; adhesions from 0.03 to 500 mu / R, where they give way less than the gel under a triangle.
  /// @param size_um  R  @throws NotSolved
  StiffnessTable(const SheetShape& shape, const sheet::OnGel& ground, const Gel& gel, double size_um, int threads);

  int n_loads() const { return static_cast<int>(equations_.pull.cols()); }
  int n_contractions() const { return n_contractions_; }  ///< the first of the loads
  bool has_line() const { return has_line_; }
  const std::vector<sheet::Bundle>& bundles() const { return bundles_; }  ///< the last of the loads
  const StiffnessRange& sheet_nN_per_um() const { return sheet_; }
  /// Where it is fitted.
  const std::optional<StiffnessRange>& adhesion_nN_per_um3() const { return adhesion_; }
  /// Where it is not; unset: bonded.
  std::optional<double> known_adhesion_nN_per_um3() const { return known_adhesion_; }
  /// Forces of the patches that make up all others, orthogonal: 2·patches × any.
  const MatrixXd& forces_nN() const { return forces_nN_; }
  /// How much of each, by load.
  MatrixXd shares(const Stiffnesses& at) const;

 private:
  std::vector<Stiffnesses> examples(Index n_loads) const;
  int n_contractions_ = 1;
  bool has_line_ = false;
  std::vector<sheet::Bundle> bundles_;
  StiffnessRange sheet_;
  std::optional<StiffnessRange> adhesion_;
  std::optional<double> known_adhesion_;
  sheet::OnGel::Reduced equations_;
  MatrixXd forces_nN_;
};

}  // namespace mbtfm::sheets
