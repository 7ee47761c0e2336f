/// Contraction, stiffness and line tension of a sheet, from the displacements of the beads under it.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "mbtfm/sheets/residuals.h"
#include "mbtfm/sheets/stiffness_table.h"
#include "mbtfm/tensions/linear_data.h"
#include "mbtfm/tensions/tension_fit.h"
#include "pipeline/contract/sheet_results.h"

namespace mbtfm::sheets {

using Quantity = SheetQuantity;

struct FittedEstimate : SheetEstimate {
  VectorXd by_unknown = {};  ///< how it follows the loads, log M and log κ
};

/// A model of the gel's motion: nothing, the sheet, the sheet with a cable along its edge, with bundles in it, on
/// springs, or with parts that contract each by its own.
using SheetModel = tensions::ModelScore;

struct SheetFit {
  std::vector<FittedEstimate> estimates;
  Stiffnesses stiffnesses;
  VectorXd loads;            ///< contractions by part, line tension, tensions of bundles
  VectorXd node_amplitudes;  ///< of the table's forces: what the sheet does at the solution
  MatrixXd answers;          ///< how the loads, log M and log κ follow the beads' displacements (2·beads), by row
  bool is_at_bound = false;  ///< the best stiffness of the sheet is the table's first or last
  double correlation = 0;    ///< of the errors of the first contraction and log stiffness
  double variance = 1;       ///< of a weighted component of a bead, that the error bars are made with
  Residuals residuals;
  double relative_l2 = 0;
  std::optional<double> expected_relative_l2;  ///< by the errors that the beads state
  int n_beads = 0, n_down_weighted = 0;
  std::vector<SheetModel> models;
  std::size_t own_model = 0;  ///< of them, the one that was fitted; others are parts of it, or beside it
  Report report;
};

/// The contractions that no cell has: best below zero, or with an interval that holds no value above.
std::vector<FittedEstimate> expanding(const SheetFit& fit);

/// One more model: forces of the adhesions, each for itself. chi² of all models is then in units of the noise that
/// these leave, or of the stated errors where these are larger.
/// @param adhesions  the beads' data in terms of the adhesions' forces
void compare_with_adhesions(SheetFit& fit, const tensions::LinearData& adhesions);

/// The beads' data in terms of the table.
/// @param ground  whose patches carry the table's forces
/// @param motions  that the beads may share besides, found with the sheet: 2·beads × some
tensions::LinearData data_of(const DisplacementField& beads, const StiffnessTable& table, const sheet::OnGel& ground,
                             const substrate::Substrate& gel, int threads, MatrixXd motions = {});

/// One more error of the estimates, independent of the others: their standard errors and intervals grow by it. A
/// stiffness that this error alone changes by a factor of e or more has neither from then on.
/// @param part  the source, whose part grows, too
/// @param sizes  a standard error each
void add_error(std::vector<FittedEstimate>& estimates, std::optional<double> SheetErrorParts::*part,
               const VectorXd& sizes);
/// The same by what they change if the beads moved otherwise.
/// @param changes_um  2·beads × errors that are independent of each other
/// @returns a standard error each
VectorXd add_error(SheetFit& fit, std::optional<double> SheetErrorParts::*part, const MatrixXd& changes_um);
/// What they change by if all forces and stiffnesses grow by a share: the beads' displacements are measured, so that is
/// what another modulus of the gel does, if no stiffness is given.
VectorXd changes_by_modulus(const std::vector<FittedEstimate>& estimates, double share);

/// Least squares (or a robust loss) over all stiffnesses of the table: of each the best loads are linear, so the misfit
/// is a function of one number, or of two where the adhesions are fitted, which are scanned and then refined (variable
/// projection). 95 % intervals: where the misfit, least over all else, is 1.96² variances above the best.
/// @param stiffness_nN_per_um  known; unset: fitted
/// @param parts  names of the table's contractions, where there are several
SheetFit fit_sheet(tensions::LinearData data, const StiffnessTable& table, tensions::Loss loss,
                   std::optional<double> stiffness_nN_per_um = {}, const std::vector<std::string>& parts = {});

}  // namespace mbtfm::sheets
