/// What a contracting sheet on a gel does to the gel, for any stiffness of the sheet.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "continuum/sheet/on_gel.h"
#include "pipeline/contract/gel.h"

namespace mbtfm::sheets {

/// The sheet without its modulus and its contraction.
struct SheetShape {
  std::shared_ptr<const sheet::Elements> elements;
  /// At the points of the elements: an even one is 1. Several parts, each with a contraction of its own, add up to 1.
  std::vector<std::vector<double>> contractions;
  double poisson_ratio = 0.5;
  double thickness_um = 1;
  int n_rims = 1;
  bool has_line = false;  ///< a line tension at the rims, too
};

/// Forces of the patches by a contraction of 1 nN/um of each part (and a line tension of 1 nN), as a function of the
/// stiffness M = E h / (1 − nu²): solved at Chebyshev's nodes of log M, interpolated between. Times 1 + M / (mu R) it
/// is bounded.
class StiffnessTable {
 public:
  static constexpr int kNodes = 20;

  /// From where the sheet is so soft that its mesh resolves it no more to where it does not strain: M / (mu R) from
  /// 0.03 to 300. @param size_um  R  @throws NotSolved
  StiffnessTable(const SheetShape& shape, const sheet::OnGel& ground, const Gel& gel, double size_um, int threads);

  int n_loads() const { return n_loads_; }
  int n_contractions() const { return n_contractions_; }  ///< the first of the loads
  double softest_nN_per_um() const;
  double stiffest_nN_per_um() const;
  /// Forces of the patches at all nodes: 2·patches × kNodes·n_loads, the loads of a node side by side.
  const Eigen::MatrixXd& forces_nN() const { return forces_nN_; }
  /// What of the nodes' forces makes up those at M: kNodes·n_loads × n_loads.
  Eigen::MatrixXd shares(double stiffness_nN_per_um) const;

 private:
  Eigen::VectorXd basis(double log_stiffness) const;
  int n_contractions_ = 1, n_loads_ = 1;
  double low_ = 0, high_ = 0;  ///< log M
  double scale_nN_per_um_ = 1;
  std::vector<double> nodes_;
  Eigen::MatrixXd forces_nN_;
};

}  // namespace mbtfm::sheets
