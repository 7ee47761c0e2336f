/// The misfit of a sheet to its beads over the stiffnesses that are not known.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "mbtfm/sheets/sheet_fit.h"
#include "mbtfm/tensions/intervals.h"

namespace mbtfm::sheets {

/// Steps of a logarithm over nine e-folds: 2 %, far below any standard error.
inline constexpr int kScan = 400;

/// The minimiser of ½ xᵀ H x − rightᵀ x in which the last n loads are not negative: bundles pull, they never push.
VectorXd best_loads(const MatrixXd& H, const VectorXd& right, Index n_bundles);

/// At one pair of stiffnesses: the best loads.
struct Profile {
  Stiffnesses at;
  VectorXd loads;
  double misfit = 0;    ///< |C R − y|², without the floor
  MatrixXd normal;      ///< of the loads
  VectorXd gradient;    ///< half of the misfit's, by the loads: above zero where a bundle is at its bound
  Index n_bundles = 0;  ///< the last of the loads

  /// How far a load may go to either side until the misfit, least over the others, has risen by `room`.
  tensions::Sides reach(Index load, double room) const;
};

inline double sheet_of(const Profile& p) { return p.at.sheet_nN_per_um; }
inline double adhesion_of(const Profile& p) { return *p.at.adhesion_nN_per_um3; }

/// Where the misfit is least over one number.
struct Line {
  std::vector<Profile> scan;
  Profile best;
};

class Search {
 public:
  /// @param known  the sheet's stiffness; unset: any of the table
  /// @param joined  the loads that are fitted as one: loads × fewer
  Search(const tensions::LinearData& data, const StiffnessTable& table, std::optional<double> known, MatrixXd joined)
      : data_(data),
        table_(table),
        known_(known),
        joined_(std::move(joined)),
        n_bundles_(joined_.bottomRows(std::ssize(table.bundles())).isZero() ? 0 : std::ssize(table.bundles())) {}
  Search(const tensions::LinearData& data, const StiffnessTable& table, std::optional<double> known)
      : Search(data, table, known, MatrixXd::Identity(table.n_loads(), table.n_loads())) {}

  Profile at(const Stiffnesses& stiffnesses) const;
  /// Over the sheet's stiffness, on adhesions of this one.
  Line over_sheet(std::optional<double> adhesion) const;
  /// Over the adhesions' stiffness, each with the best of the sheet.
  Line over_adhesion() const;
  /// Over the sheet's stiffness, each with the best of the adhesions'.
  Line over_sheet_with_best_adhesion() const;
  /// Of the table's forces.
  VectorXd amplitudes(const Profile& p) const { return table_.shares(p.at) * (joined_ * p.loads); }
  Profile best() const;

 private:
  const tensions::LinearData& data_;
  const StiffnessTable& table_;
  std::optional<double> known_;
  MatrixXd joined_;
  Index n_bundles_;
};

/// The loads of a sheet whose parts all contract alike.
MatrixXd of_even_parts(const StiffnessTable& table);
/// Those of a sheet without its bundles.
MatrixXd without_bundles(const StiffnessTable& table);

/// About a solution: the loads, log M and log κ as directions of the table's forces, and which of them are unknown. A
/// stiffness that is given is not, nor a bundle that does not pull.
struct Directions {
  MatrixXd forces;  ///< a column each
  std::vector<Index> unknown;

  MatrixXd normal(const tensions::LinearData& data) const;  ///< of the unknown ones
  /// The same if the beads shared no motion.
  MatrixXd normal_without_motion(const tensions::LinearData& data) const;
};
Directions directions_about(const StiffnessTable& table, const Stiffnesses& at, const VectorXd& loads,
                            bool is_sheet_known);

/// Standard errors about a solution, and how it follows the beads.
struct Linearised {
  MatrixXd covariance;      ///< of the loads, log M and log κ; 0 of what is known
  MatrixXd without_motion;  ///< the same if the beads shared no motion
  MatrixXd answers;         ///< SheetFit::answers: none of a stiffness that is not resolved
};
/// What these amplitudes leave of the beads, and how the fit follows their noise.
/// @param prior  beside the normal equations, by the first of the columns; empty: none
Residuals residuals_of(const tensions::LinearData& data, const VectorXd& node_amplitudes, const Directions& about,
                       const MatrixXd& prior = {});
Linearised linearised(const tensions::LinearData& data, const Directions& about, double variance,
                      const MatrixXd& prior = {});
/// Splits the standard errors that noise and misfit give. @param variance  the beads' share of the variance
void split_by_noise(std::vector<FittedEstimate>& estimates, const Linearised& about, double variance,
                    const tensions::LinearData& data);

/// An estimate with its standard error; none where an end of its interval is open.
FittedEstimate fitted_estimate(SheetEstimate estimate, double variance, VectorXd by_unknown);

/// Weights of the beads by a robust loss, until they stay. Tukey's has several minima: it starts from Huber's, whose
/// scale it keeps.
/// @param amplitudes  of the table's forces, as the fit to such data has them
tensions::LinearData weighed(tensions::LinearData data, tensions::Loss loss,
                             const std::function<VectorXd(const tensions::LinearData&)>& amplitudes);

/// The solution as displacements: node_amplitudes, and how they fit. @param n_unknowns  numbers that the beads fixed
void add_misfit(SheetFit& fit, const tensions::LinearData& data, VectorXd node_amplitudes, double n_unknowns);

/// Models of the same beads, in units of the noise. The first is nothing.
class Models {
 public:
  Models(const tensions::LinearData& data, double noise_variance);
  /// @param amplitudes  of the table's forces
  void add(const std::string& name, Index n_parameters, const VectorXd& amplitudes);
  const std::vector<SheetModel>& all() const { return all_; }

 private:
  const tensions::LinearData& data_;
  double noise_;
  std::vector<SheetModel> all_;
};

}  // namespace mbtfm::sheets
